"""Draw the chain of transforms of both mountings, as docs/model.md shows it.

    .venv/bin/python tools/draw_chain.py

Writes docs/images/chain.svg.
"""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WIDTH, HEIGHT = 760, 280
STYLE = """.arrow{stroke:#0b5cad;stroke-width:2;marker-end:url(#head)}
.name{font-style:italic;font-size:18px;fill:#0b5cad}
.frame{fill:#eef2f5;stroke:#5a6b7b}text{font-size:14px;fill:#16202b}"""
HEAD = """<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7"
orient="auto"><path d="M0 0 8 4 0 8z" fill="#0b5cad"/></marker></defs>"""
# Frames of both mountings with their places, and the transforms between them: name, into, from.
MOUNTINGS = (
    (
        "camera in the hand",
        {"base": (70, 240), "flange": (150, 90), "camera": (290, 60), "target": (320, 240)},
        (("X", "camera", "flange"), ("A", "flange", "base"), ("Y", "base", "target")),
    ),
    (
        "camera beside the arm",
        {"base": (450, 240), "flange": (530, 90), "camera": (700, 240), "target": (680, 60)},
        (("X", "camera", "base"), ("A", "base", "flange"), ("Y", "flange", "target")),
    ),
)


def text(x: float, y: float, words: str, more: str = "") -> str:
    """Return words around a place."""
    return f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="middle" {more}>{words}</text>'


def arrow(start: tuple[float, float], end: tuple[float, float], name: str, *, dashed: bool = False) -> str:
    """Return an arrow that ends before the frames, with its name beside it."""
    (x0, y0), (x1, y1) = start, end
    far = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
    u, v = (x1 - x0) / far, (y1 - y0) / far
    more = ' stroke-dasharray="5 4"' if dashed else ""
    ends = (x0 + 34 * u, y0 + 22 * v, x1 - 36 * u, y1 - 24 * v)
    places = " ".join(
        f'{end}="{value:.0f}"' for end, value in zip(("x1", "y1", "x2", "y2"), ends, strict=True)
    )
    line = f"<line {places}"
    off = 8 + 6 * len(name)
    middle = ((x0 + x1) / 2 - off * v, (y0 + y1) / 2 + off * u + 5)
    return f'{line} class="arrow"{more}/>' + text(*middle, name, 'class="name"')


def drawn() -> str:
    """Return the drawing as SVG."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif">',
        f"<style>{STYLE}</style>",
        HEAD,
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
    ]
    for title, frames, chain in MOUNTINGS:
        middle = sum(x for x, _ in frames.values()) / len(frames)
        parts.append(text(middle, 24, title, 'font-weight="bold"'))
        parts += [arrow(frames[end], frames[start], name) for name, start, end in reversed(chain)]
        parts.append(arrow(frames["camera"], frames["target"], "view", dashed=True))
        for name, (x, y) in frames.items():
            parts.append(f'<rect x="{x - 32}" y="{y - 15}" width="64" height="28" rx="5" class="frame"/>')
            parts.append(text(x, y + 4, name))
    return "\n".join([*parts, "</svg>"]) + "\n"


if __name__ == "__main__":
    (ROOT / "docs" / "images" / "chain.svg").write_text(drawn())
