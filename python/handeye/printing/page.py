"""A drawing as a file."""

from handeye.codes import Code
from handeye.errors import OutputError
from handeye.printing.shapes import Drawing
from handeye.printing.svg import svg

FORMATS = ("pdf", "svg")


def page(drawing: Drawing, kind: str) -> bytes:
    """Return the file of a kind, one of `FORMATS`.

    Raises
    ------
    OutputError
        Another kind.
    """
    if kind == "svg":
        return svg(drawing)
    if kind != "pdf":
        raise OutputError(
            f"a page as {kind[:20]!r}, expected {' or '.join(FORMATS)}", code=Code.UNKNOWN_FORMAT
        )
    from handeye.printing.pdf import pdf  # noqa: PLC0415 - matplotlib takes a while

    return pdf(drawing)
