// Curves of what was stated and asked, bars of predicted and realised gain, and shares, as SVG.
const $ = (id) => document.getElementById(id);
const NAMES = { none: "pixels alone", flange: "robot, flange side", base: "robot, base side", joints: "joints", links: "links of the arm" };
const W = 360, H = 150, L = 44, R = 12, T = 18, B = 26;
const figures = (v) => Number(v.toPrecision(2)).toString();

function svg(label, inner) { return `<svg viewBox="0 0 ${W} ${H}" role="img" aria-label="${label}">${inner}</svg>`; }

function curve(points, key, asked, title, unit) {
  if (!points.length) return "";
  const values = points.map((p) => p[key]).concat(asked ? [asked] : []);
  const low = Math.log10(Math.min(...values)) - 0.08, high = Math.log10(Math.max(...values)) + 0.08;
  const first = points[0].views, last = Math.max(points.at(-1).views, first + 1);
  const x = (n) => L + (W - L - R) * (n - first) / (last - first), y = (v) => T + (H - T - B) * (high - Math.log10(v)) / (high - low || 1);
  let inner = `<text x="${L}" y="12">${title}, ${unit}</text>`;
  for (const v of ticks(10 ** low, 10 ** high)) inner += `<line x1="${L}" x2="${W - R}" y1="${y(v)}" y2="${y(v)}" stroke="#e0e6eb"/><text x="${L - 5}" y="${y(v) + 4}" text-anchor="end">${v}</text>`;
  if (asked) inner += `<line x1="${L}" x2="${W - R}" y1="${y(asked)}" y2="${y(asked)}" stroke="#1a6f3c" stroke-dasharray="5 4" stroke-width="1.5"/><text x="${L + 4}" y="${y(asked) - 4}" fill="#1a6f3c">asked ${figures(asked)}</text>`;
  inner += `<polyline fill="none" stroke="#0b5cad" stroke-width="2" points="${points.map((p) => `${x(p.views)},${y(p[key])}`).join(" ")}"/>`;
  for (const p of points) inner += `<circle cx="${x(p.views)}" cy="${y(p[key])}" r="3" fill="#0b5cad"/>`;
  const every = Math.ceil((last - first) / 8);
  for (let n = first; n <= last; n += every) inner += `<text x="${x(n)}" y="${H - 8}" text-anchor="middle">${n}</text>`;
  return svg(`${title} stated after each number of views, ${unit}: ${points.map((p) => `${p.views}: ${figures(p[key])}`).join(", ")}`, inner);
}

function ticks(low, high) {
  const all = [];
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); e++) for (const s of [1, 2, 5]) all.push(Number((s * 10 ** e).toPrecision(3)));
  const inside = all.filter((v) => v >= low && v <= high);
  return inside.length > 6 ? inside.filter((v) => /^(0\.)?0*1/.test(String(v))) : inside;
}

function bars(gains) {
  if (!gains.length) return "";
  const known = gains.slice(-12), most = Math.max(...known.flatMap((g) => [g.predicted, g.realised ?? 0]), 0.1);
  const wide = (W - L - R) / known.length, y = (v) => T + (H - T - B) * (1 - Math.max(v, 0) / most);
  let inner = `<text x="${L}" y="12">gain of each view, nats: predicted (light), realised (dark)</text><text x="${L - 5}" y="${T + 8}" text-anchor="end">${figures(most)}</text><text x="${L - 5}" y="${H - B}" text-anchor="end">0</text><line x1="${L}" x2="${W - R}" y1="${H - B}" y2="${H - B}" stroke="#8a97a3"/>`;
  known.forEach((g, i) => {
    const x = L + i * wide + wide * 0.15, w = wide * 0.35;
    inner += `<rect x="${x}" y="${y(g.predicted)}" width="${w}" height="${H - B - y(g.predicted)}" fill="#8cb8e0"/>`;
    if (g.realised !== null) inner += `<rect x="${x + w}" y="${y(g.realised)}" width="${w}" height="${H - B - y(g.realised)}" fill="#0b5cad"/>`;
    inner += `<text x="${x + w}" y="${H - 8}" text-anchor="middle">${g.views}</text>`;
  });
  return svg(`Predicted and realised gain: ${known.map((g) => `view ${g.views}: ${figures(g.predicted)} and ${g.realised === null ? "not known" : figures(g.realised)}`).join(", ")}`, inner);
}

export function charts(d) {
  $("now").textContent = d.now
    ? `Within ${figures(d.now.translation_mm)} mm and ${figures(d.now.rotation_deg)} deg with 95 % probability`
    : d.open.length ? `Not determined yet: ${d.open[0]}` : "Nothing is known yet: three views are needed.";
  if (d.asked && d.now) $("now").textContent += `; asked: ${figures(d.asked.mm)} mm and ${figures(d.asked.deg)} deg.`;
  $("curves").innerHTML = curve(d.curve, "mm", d.asked?.mm, "95 % radius of the position", "mm") + curve(d.curve, "deg", d.asked?.deg, "95 % radius of the rotation", "deg") + bars(d.gains);
  $("shares").replaceChildren(...d.shares.map((s) => {
    const row = Object.assign(document.createElement("div"), { className: "share" });
    const bar = Object.assign(document.createElement("span"), { className: "bar" });
    bar.style.width = `${100 * s.share}%`;
    row.append(NAMES[s.name] ?? s.name, bar, `${Math.round(100 * s.share)} %`);
    return row;
  }));
  $("sentence").textContent = d.sentence ?? "";
}
