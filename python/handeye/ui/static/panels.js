// The parts of the page that are words, tables and the picture.
import { colour } from "./scene.js";
import { send } from "./app.js";

const $ = (id) => document.getElementById(id);
const figures = (v) => Number(v.toPrecision(2)).toString();
const element = (tag, values = {}, ...children) => { const e = Object.assign(document.createElement(tag), values); e.append(...children); return e; };
const PHASES = { start: "a small turn about where the arm stands", plan: "the place that teaches most", nudge: "half way back to where the target was seen", back: "back the way it came", retry: "the same place again", hand: "where the arm stands" };
let live = null, picked = null, tell = () => {}, drawn = 0;

function state(d) {
  if (d.kind === "still") return d.unit === "station" ? `${d.cameras} cameras, ${d.views} stations.` : `${d.views} views, model ${d.model}.`;
  if (d.end) return `Ended: ${d.end.sentence}.`;
  const next = d.label ? `${d.label}: ${PHASES[d.phase] ?? d.phase}${typeof d.gain === "number" ? `, predicted gain ${figures(d.gain)} nats` : ""}` : "";
  if (d.state === "waiting") return `Next is ${next}. Waiting for you.`;
  if (d.state === "moving") return `The arm moves to ${next}.`;
  if (d.state === "preparing") return "Getting ready.";
  return `Deciding what to do next. ${d.views} ${d.unit}s so far.`;
}

function paint(d, source) {
  const canvas = $("picture"), g = canvas.getContext("2d"), mine = ++drawn;
  const [w, h] = d.size;
  const finish = (image) => {
    if (mine !== drawn) return;
    canvas.width = w; canvas.height = h;
    g.fillStyle = "#3a4653"; g.fillRect(0, 0, w, h);
    if (image) g.drawImage(image, 0, 0, w, h);
    const u = Math.max(w, h) / 640;
    if (d.predicted) {
      g.strokeStyle = "#ff5a4f"; g.lineWidth = 1.6 * u; g.beginPath();
      d.found?.forEach((p, i) => {
        const q = d.predicted[i], m = d.magnification, x = q[0] + m * (p[0] - q[0]), y = q[1] + m * (p[1] - q[1]), a = Math.atan2(y - q[1], x - q[0]);
        g.moveTo(q[0], q[1]); g.lineTo(x, y);
        g.moveTo(x - 5 * u * Math.cos(a - 0.5), y - 5 * u * Math.sin(a - 0.5)); g.lineTo(x, y); g.lineTo(x - 5 * u * Math.cos(a + 0.5), y - 5 * u * Math.sin(a + 0.5));
      });
      g.stroke();
      g.strokeStyle = "#ffd24a"; g.lineWidth = u; g.beginPath();
      for (const q of d.predicted) { g.moveTo(q[0] - 3 * u, q[1]); g.lineTo(q[0] + 3 * u, q[1]); g.moveTo(q[0], q[1] - 3 * u); g.lineTo(q[0], q[1] + 3 * u); }
      g.stroke();
    }
    if (d.found) { g.strokeStyle = "#35d07f"; g.lineWidth = u; g.beginPath(); for (const p of d.found) { g.moveTo(p[0] + 3.5 * u, p[1]); g.arc(p[0], p[1], 3.5 * u, 0, 7); } g.stroke(); }
    const text = d.found
      ? `${d.label}: ${d.found.length} points found (green circles)` + (d.predicted ? `, where the answer expects them (yellow crosses), and how far they are off, drawn ${d.magnification} times longer (red arrows): ${figures(d.rmse_px)} px RMS` : "; nothing is predicted yet")
      : `${d.label}: the target was not found`;
    $("picture-text").textContent = text; canvas.setAttribute("aria-label", text);
  };
  if (!source) return finish(null);
  const image = new Image();
  image.onload = () => finish(image); image.onerror = () => finish(null); image.src = source;
}

function coverage({ name, cells }) {
  const all = cells.flat(), most = Math.max(1, ...all), empty = all.filter((n) => n === 0).length, of = name ? ` of ${name}` : "";
  const drawn = cells.flatMap((row, y) => row.map((n, x) => `<rect x="${x}" y="${y}" width=".94" height=".94" fill="${n ? colour(0.25 + 0.75 * n / most) : "#e3e8ec"}"/>`)).join("");
  return `<div><svg viewBox="0 0 8 6" role="img" aria-label="Where in the picture${of} the target was seen">${drawn}</svg><span>Points seen in ${all.length - empty} of ${all.length} parts of the picture${of}${empty ? "; grey parts have none yet" : ""}.</span></div>`;
}

export const panels = {
  onPick(call) { tell = call; },
  complain(text) { this.trouble = text; $("failure").textContent = text; $("failure").hidden = !text; },

  people(d, drives) {
    const others = d.watchers - 1;
    $("people").textContent = `${drives ? "You drive" : "You look on"}${others > 0 ? `; ${others} more ${others > 1 ? "pages are" : "page is"} open` : ""}.`;
    $("take-over").hidden = drives || !$("buttons").checkVisibility();
  },

  status(d, drives) {
    $("title").textContent = d.title; document.title = `handeye: ${d.title}`;
    $("state").textContent = state(d);
    if (!this.trouble) {
      const last = d.last?.failure && d.last.failure !== "withdrawn" ? `${d.last.label}: ${d.last.detail}` : "";
      $("failure").textContent = last; $("failure").hidden = !last;
    }
    document.body.classList.toggle("still", !d.drives);
    if (!d.drives) { $("buttons").hidden = $("take-over").hidden = $("people").hidden = true; return; }
    const waiting = d.state === "waiting", ended = Boolean(d.end);
    const may = { go: waiting, run_on: waiting, skip: waiting, here: waiting, withdraw: (waiting || ended) && d.views > 0, finish: waiting || ended, pause: !waiting && !ended && d.pace === "on" };
    document.querySelector("[data-action=go]").textContent = `Take ${d.unit}`;
    document.querySelector("[data-action=withdraw]").textContent = `Undo last ${d.unit}`;
    $("more-what").textContent = `${d.unit}s`;
    for (const b of document.querySelectorAll("[data-action]")) if (b.dataset.action !== "stop") b.disabled = !drives || !may[b.dataset.action];
    $("upload").hidden = !(d.uploads && drives && d.state === "moving");
    const show = ended && drives;
    if (show && $("more").hidden) {
      $("more-views").value = d.most_views + 10;
      [$("more-mm").value, $("more-deg").value] = d.asked ?? ["", ""];
    }
    $("more").hidden = !show;
  },

  talk(d) {
    const log = $("log"), low = log.scrollHeight - log.scrollTop - log.clientHeight < 40;
    log.replaceChildren(...d.messages.map((m) => element("div", { textContent: m })));
    if (low) log.scrollTop = log.scrollHeight;
    const q = d.question;
    $("question").hidden = !q;
    if (q && $("question").dataset.id !== q.id) { $("question").dataset.id = q.id; $("question-text").textContent = q.text; $("answer").focus(); }
  },

  views(d, drives, status) {
    let before = null;
    $("views").replaceChildren(...d.views.map((v) => {
      const show = element("button", { className: "link", textContent: v.name, type: "button" });
      show.addEventListener("click", () => this.pick(v.name));
      const bad = element("button", { textContent: "Mark as bad", type: "button", disabled: !status?.drives });
      const whole = v.station ?? v.name, offered = status?.drives && whole !== before; // a station goes as a whole
      before = whole;
      bad.setAttribute("aria-label", `Mark ${whole} as bad`);
      bad.addEventListener("click", () => send("withdraw", { view: whole }));
      return element("tr", {}, element("td", {}, show), element("td", { textContent: v.points }), element("td", { textContent: v.rmse_px === null ? "" : v.rmse_px.toFixed(3) }), element("td", {}, offered ? bad : ""));
    }));
    $("rejected").replaceChildren(...d.rejected.map((r) => element("li", { textContent: `${r.name}: ${r.why}` })));
    $("coverage").className = d.coverage.length > 1 ? "several" : "";
    $("coverage").innerHTML = d.views.length ? d.coverage.map(coverage).join("") : "";
    if (picked) this.pick(picked);
  },

  async pick(name) {
    picked = name; tell(name); $("live").hidden = !live;
    $("live").onclick = () => { picked = null; tell(null); $("live").hidden = true; this.picture(live); };
    const answer = await fetch(`view/${encodeURIComponent(name)}`);
    if (!answer.ok) { picked = null; return; }
    const d = await answer.json();
    paint(d, d.has_image ? `view_picture/${encodeURIComponent(name)}` : null);
  },

  picture(d) {
    live = d;
    if (picked) return;
    if (!d) { $("picture-text").textContent = "No picture yet; press the name of a view to see it."; return; }
    paint(d, d.has_image ? `picture/${d.number}` : null);
  },

  legend(scene, candidates) {
    const parts = [];
    const add = (fill, text) => { const s = element("span", { className: "swatch" }); s.style.background = fill; parts.push(s, text); };
    if (scene?.views.length) add("#0b5cad", "views taken ");
    if (scene?.goal) add("#d0660a", "where it should go ");
    if (candidates?.poses.length) { add(colour(0), "little"); add(colour(1), "much gained "); }
    if (candidates?.ruled_out.length) add("#8a97a3", "ruled out (x) ");
    const drawn = (scene?.ellipsoids ?? []).map((e) => `${e.name} (longest half axis ${figures(e.longest_mm)} mm) ${e.magnification} times larger`);
    if (drawn.length) add("#a3007a", `95 % ellipsoids: ${drawn.join(", ")}`);
    $("legend").replaceChildren(...parts);
  },

  candidates(d) {
    $("candidates").parentElement.hidden = !d.poses.length && !d.ruled_out.length;
    const order = d.gains.map((g, i) => [g, i]).filter(([g]) => g !== null).sort((a, b) => b[0] - a[0]).slice(0, 10);
    const counts = d.reasons.map((r, k) => `${r}: ${d.reason_of.filter((x) => x === k).length}`);
    $("candidates").replaceChildren(
      element("p", { textContent: `${d.poses.length} can be taken; ${d.ruled_out.length} are ruled out.` }),
      element("ol", {}, ...order.map(([g, i]) => element("li", { textContent: `${d.names[i]}: gain ${g.toFixed(3)}${d.names[i] === d.chosen ? " (next)" : ""}` }))),
      element("ul", {}, ...counts.map((c) => element("li", { textContent: c }))),
    );
  },
};
