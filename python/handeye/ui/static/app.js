// Follows the versions that the program tells, fetches what has changed, and sends what is pressed.
import { Scene } from "./scene.js";
import { charts } from "./charts.js";
import { panels } from "./panels.js";

const page = sessionStorage.page ??= crypto.getRandomValues(new Uint32Array(4)).reduce((s, n) => s + n.toString(16).padStart(8, "0"), "");
let seen = {};
const fetching = {}, data = {};
const $ = (id) => document.getElementById(id);

export async function send(action, values = {}) {
  const answer = await fetch("command", {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify({ page, action, ...values }),
  }).catch(() => null);
  const said = answer ? await answer.json().catch(() => ({})) : { error: { message: "the program cannot be reached" } };
  panels.complain(said.error ? said.error.message + (said.error.hint ? ` (${said.error.hint})` : "") : "");
}

async function bring(file) {
  const answer = await fetch("picture", {
    method: "POST", headers: { "Content-Type": "application/octet-stream" }, body: file,
  }).catch(() => null);
  const said = answer ? await answer.json().catch(() => ({})) : { error: { message: "the program cannot be reached" } };
  panels.complain(said.error ? said.error.message : "");
}

const scene = new Scene($("scene"), $("tip"));
const draw = {
  model: (d) => scene.setModel(d),
  scene: (d) => { scene.setScene(d); panels.legend(d, data.candidates); },
  candidates: (d) => { d.poses = rows(d.poses); d.ruled_out = rows(d.ruled_out); scene.setCandidates(d); panels.candidates(d); panels.legend(data.scene, d); },
  status: (d) => { panels.status(d, drives()); if (data.people) panels.people(data.people, drives()); if (data.views) panels.views(data.views, drives(), d); },
  people: (d) => { panels.people(d, drives()); if (data.status) panels.status(data.status, drives()); },
  talk: (d) => panels.talk(d),
  knowledge: (d) => charts(d),
  views: (d) => panels.views(d, drives(), data.status),
  picture: (d) => panels.picture(d),
};
const drives = () => Boolean(data.people && data.people.driver === page.slice(0, 8) && data.status && data.status.drives);

// Poses that came packed: rows of twelve 32-bit numbers.
function rows(packed) {
  const numbers = new Float32Array(Uint8Array.from(atob(packed), (c) => c.charCodeAt(0)).buffer);
  return Array.from({ length: numbers.length / 12 }, (_, i) => numbers.subarray(12 * i, 12 * i + 12));
}

async function update(name, version) {
  if (fetching[name]) { fetching[name] = version; return; }
  fetching[name] = version;
  try {
    const answer = await fetch(`document/${name}`);
    if (answer.ok) {
      const found = await answer.json();
      seen[name] = found.version;
      data[name] = found.data;
      draw[name]?.(found.data);
    }
  } catch { /* the stream says when the program is gone */ }
  const wanted = fetching[name];
  fetching[name] = 0;
  if (wanted > (seen[name] ?? 0) && wanted !== version) update(name, wanted);
}

function listen() {
  const stream = new EventSource(`events?page=${page}`);
  stream.onmessage = (event) => {
    $("gone").hidden = true;
    for (const [name, version] of Object.entries(JSON.parse(event.data)))
      if (version > (seen[name] ?? 0)) update(name, version);
  };
  stream.onopen = () => { seen = {}; }; // perhaps another program by now
  stream.onerror = () => {
    $("gone").hidden = false;
    if (stream.readyState === EventSource.CLOSED) setTimeout(listen, 1500);
  };
}

for (const button of document.querySelectorAll("[data-action]"))
  button.addEventListener("click", () => send(button.dataset.action));
$("take-over").addEventListener("click", () => send("take_over"));
$("question").addEventListener("submit", (event) => {
  event.preventDefault();
  send("answer", { id: data.talk.question?.id, text: $("answer").value });
  $("answer").value = "";
});
$("file").addEventListener("change", () => { if ($("file").files[0]) bring($("file").files[0]); $("file").value = ""; });
$("more").addEventListener("submit", (event) => {
  event.preventDefault();
  send("more", {
    accuracy_mm: Number($("more-mm").value), accuracy_deg: Number($("more-deg").value),
    most_views: Number($("more-views").value),
  });
});
panels.onPick((name) => scene.mark(name));
listen();
