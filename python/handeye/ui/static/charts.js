// Curves of what was stated and asked, bars of predicted and realised gain, and shares, as SVG.
const $ = (id) => document.getElementById(id);
const NAMES = { pixels: "noise of the pictures", robot: "robot, new at every view", robot_smooth: "robot, alike in like postures", arm: "how the arm is built", camera: "calibration of the camera", board: "size of the target" };
const COLOURS = ["#0b5cad", "#b35900", "#1a6f3c", "#7a3aa8", "#8a1f4d", "#3d5566"];
const W = 360, H = 150, L = 44, R = 12, T = 18, B = 26;
const figures = (v) => Number(v.toPrecision(2)).toString();

function svg(label, inner) { return `<svg viewBox="0 0 ${W} ${H}" role="img" aria-label="${label}">${inner}</svg>`; }

function curve(curves, key, asked, title, unit) {
  const drawn = curves.filter((c) => c.points.length);
  if (!drawn.length) return "";
  const all = drawn.flatMap((c) => c.points), values = all.map((p) => p[key]).concat(asked ? [asked] : []);
  const low = Math.log10(Math.min(...values)) - 0.08, high = Math.log10(Math.max(...values)) + 0.08;
  const first = Math.min(...all.map((p) => p.views)), last = Math.max(...all.map((p) => p.views), first + 1);
  const x = (n) => L + (W - L - R) * (n - first) / (last - first), y = (v) => T + (H - T - B) * (high - Math.log10(v)) / (high - low || 1);
  let inner = `<text x="${L}" y="12">${title}, ${unit}</text>`;
  for (const v of ticks(10 ** low, 10 ** high)) inner += `<line x1="${L}" x2="${W - R}" y1="${y(v)}" y2="${y(v)}" stroke="#e0e6eb"/><text x="${L - 5}" y="${y(v) + 4}" text-anchor="end">${v}</text>`;
  if (asked) inner += `<line x1="${L}" x2="${W - R}" y1="${y(asked)}" y2="${y(asked)}" stroke="#1a6f3c" stroke-dasharray="5 4" stroke-width="1.5"/>`;
  drawn.forEach((c, i) => {
    const ink = COLOURS[i % COLOURS.length];
    inner += `<polyline fill="none" stroke="${ink}" stroke-width="2"${c.name === "planned" ? ' stroke-dasharray="4 3"' : ""} points="${c.points.map((p) => `${x(p.views)},${y(p[key])}`).join(" ")}"/>`;
    for (const p of c.points) inner += `<circle cx="${x(p.views)}" cy="${y(p[key])}" r="3" fill="${ink}"/>`;
  });
  if (asked) inner += `<text x="${L + 4}" y="${y(asked) - 4}" fill="#1a6f3c">asked ${figures(asked)}</text>`;
  const every = Math.ceil((last - first) / 8);
  for (let n = first; n <= last; n += every) inner += `<text x="${x(n)}" y="${H - 8}" text-anchor="middle">${n}</text>`;
  const told = drawn.map((c) => `${c.name ? `${c.name}: ` : ""}${c.points.map((p) => `${p.views}: ${figures(p[key])}`).join(", ")}`);
  return svg(escaped(`${title} stated after each number of views, ${unit}: ${told.join("; ")}`), inner);
}

const escaped = (text) => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);

function key(curves) {
  const named = curves.filter((c) => c.name && c.points.length);
  if (!named.length) return [];
  const names = curves.length > named.length ? [{ name: "as taken", of: curves.find((c) => !c.name) }, ...named.map((c) => ({ name: c.name, of: c }))] : named.map((c) => ({ name: c.name, of: c }));
  return names.flatMap(({ name, of }) => {
    const swatch = Object.assign(document.createElement("span"), { className: "swatch" });
    swatch.style.background = COLOURS[curves.filter((c) => c.points.length).indexOf(of) % COLOURS.length];
    return [swatch, `${name} `];
  });
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

const radii = (n) => `within ${figures(n.translation_mm)} mm and ${figures(n.rotation_deg)} deg`;

export function charts(d) {
  const lines = d.now.map((n) => (n.name ? `${n.name}: ${radii(n)}` : `${radii(n)[0].toUpperCase()}${radii(n).slice(1)} with 95 % probability`));
  if (!lines.length) lines.push(d.open.length ? `Not determined yet: ${d.open[0]}` : "Nothing is known yet: three views are needed.");
  else if (d.now[0].name) lines.push("each with 95 % probability");
  if (d.asked && d.now.length) lines[lines.length - 1] += `; asked: ${figures(d.asked.mm)} mm and ${figures(d.asked.deg)} deg.`;
  $("now").replaceChildren(...lines.map((text) => Object.assign(document.createElement("div"), { textContent: text })));
  $("curves").innerHTML = curve(d.curves, "mm", d.asked?.mm, "95 % radius of the position", "mm") + curve(d.curves, "deg", d.asked?.deg, "95 % radius of the rotation", "deg") + bars(d.gains);
  $("key").replaceChildren(...key(d.curves));
  $("limits").textContent = d.shares_of ? `What limits the accuracy of ${d.shares_of}` : "What limits the accuracy now";
  $("limits").hidden = !d.shares.length;
  $("shares").replaceChildren(...d.shares.map((s) => {
    const row = Object.assign(document.createElement("div"), { className: "share" });
    const bar = Object.assign(document.createElement("span"), { className: "bar" });
    bar.style.width = `${100 * s.share}%`;
    row.append(NAMES[s.name] ?? s.name, bar, `${Math.round(100 * s.share)} %`);
    return row;
  }));
  $("sentence").textContent = d.sentence ?? "";
}
