// Draws the cell in space: parallel to nothing, from far, painted from back to front; no library, no WebGL.
const RED = "#b3140f", BLUE = "#0b5cad", GREY = "#8a97a3";
const mul = (m, p) => [m[0]*p[0]+m[1]*p[1]+m[2]*p[2]+m[3], m[4]*p[0]+m[5]*p[1]+m[6]*p[2]+m[7], m[8]*p[0]+m[9]*p[1]+m[10]*p[2]+m[11]];

// Viridis at eight places, dark to light: a higher gain is lighter and greener.
const SCALE = [[68,1,84],[70,50,126],[54,92,141],[39,127,142],[31,161,135],[74,193,109],[160,218,57],[253,231,37]];
export function colour(share) {
  const x = Math.min(Math.max(share, 0), 1) * (SCALE.length - 1), i = Math.min(Math.floor(x), SCALE.length - 2), f = x - i;
  return `rgb(${SCALE[i].map((v, k) => Math.round(v + f * (SCALE[i + 1][k] - v))).join(",")})`;
}

export class Scene {
  constructor(canvas, tip) {
    Object.assign(this, { canvas, tip, azimuth: 0.9, elevation: 0.45, zoom: 1, middle: [0, 0, 0.4], reach: 1, marked: null });
    this.model = { links: [] }; this.scene = null; this.candidates = null; this.placed = [];
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener("pointerdown", (e) => { this.drag = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
    canvas.addEventListener("pointerup", () => { this.drag = null; this.ask(); });
    canvas.addEventListener("pointermove", (e) => {
      if (this.drag) { this.turn((e.clientX - this.drag[0]) * 0.008, (e.clientY - this.drag[1]) * 0.006); this.drag = [e.clientX, e.clientY]; }
      else this.hover(e.offsetX, e.offsetY);
    });
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); this.nearer(e.deltaY < 0 ? 1.12 : 1 / 1.12); }, { passive: false });
    canvas.addEventListener("keydown", (e) => {
      const step = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
      if (step) { e.preventDefault(); this.turn(...step); }
      if (e.key === "+" || e.key === "=") this.nearer(1.15);
      if (e.key === "-") this.nearer(1 / 1.15);
    });
  }

  setModel(model) { this.model = model; this.ask(); }
  setScene(scene) { this.scene = scene; this.fit(); this.ask(); }
  setCandidates(candidates) {
    this.candidates = candidates;
    const known = candidates.gains.filter((g) => g !== null);
    this.low = Math.min(...known); this.high = Math.max(...known);
    this.fit(); this.ask();
  }
  mark(name) { this.marked = name; this.ask(); }
  turn(a, e) { this.azimuth -= a; this.elevation = Math.min(1.5, Math.max(-0.2, this.elevation + e)); this.ask(); }
  nearer(f) { this.zoom = Math.min(8, Math.max(0.3, this.zoom * f)); this.ask(); }
  resize() {
    const ratio = Math.min(devicePixelRatio || 1, 2), box = this.canvas.getBoundingClientRect();
    this.canvas.width = Math.max(1, box.width * ratio); this.canvas.height = Math.max(1, box.height * ratio);
    this.ratio = ratio; this.ask();
  }
  ask() { this.asked ??= requestAnimationFrame(() => { this.asked = null; this.draw(); }); }

  fit() {
    const points = [[0, 0, 0]];
    const s = this.scene;
    if (s) {
      for (const f of [s.arm, s.ghost]) if (f) for (const m of f) points.push([m[3], m[7], m[11]]);
      for (const group of [s.boards, s.cameras, s.views]) for (const one of group) points.push([one.pose[3], one.pose[7], one.pose[11]]);
    }
    for (const m of this.candidates?.poses ?? []) points.push([m[3], m[7], m[11]]);
    const low = [0, 1, 2].map((i) => Math.min(...points.map((p) => p[i]))), high = [0, 1, 2].map((i) => Math.max(...points.map((p) => p[i])));
    this.middle = low.map((v, i) => (v + high[i]) / 2);
    this.reach = Math.max(0.25, ...low.map((v, i) => (high[i] - v) / 2)) * 1.25;
  }

  project(p) {
    const x = p[0] - this.middle[0], y = p[1] - this.middle[1], z = p[2] - this.middle[2];
    const right = -this.sa * x + this.ca * y, front = this.ca * x + this.sa * y;
    const up = -this.se * front + this.ce * z, near = this.ce * front + this.se * z;
    const k = this.k / (1 - near / (this.reach * 9));
    return [this.cx + k * right, this.cy - k * up, near];
  }

  draw() {
    const g = this.canvas.getContext("2d"), w = this.canvas.width, h = this.canvas.height;
    [this.sa, this.ca, this.se, this.ce] = [Math.sin(this.azimuth), Math.cos(this.azimuth), Math.sin(this.elevation), Math.cos(this.elevation)];
    this.cx = w / 2; this.cy = h / 2; this.k = 0.46 * Math.min(w, h * 1.25) / this.reach * this.zoom;
    g.clearRect(0, 0, w, h);
    g.lineJoin = g.lineCap = "round"; g.lineWidth = 1.2 * this.ratio;
    this.background(g, w, h);
    const s = this.scene;
    if (!s) return;
    const items = [];
    this.solid(items, s.arm, false); this.solid(items, s.ghost, true);
    for (const board of s.boards) this.board(items, board);
    items.sort((a, b) => a.near - b.near);
    for (const item of items) item.paint(g);
    for (const view of s.views) this.frustum(g, view, 0.055 * this.reach, view.name === this.marked ? RED : BLUE, view.name === this.marked ? 2.5 : 1.2, view.name);
    for (const camera of s.cameras) this.frustum(g, camera, 0.1 * this.reach, "#16202b", 2.4, camera.name);
    if (s.goal) this.frustum(g, s.goal, 0.1 * this.reach, "#d0660a", 2.4, "where it should go");
    for (const e of s.ellipsoids) this.ellipsoid(g, e);
    if (s.cameras.length > 1 || s.boards.length > 1) this.names(g, [...s.cameras, ...s.boards]);
    if (s.flange && !s.arm) this.axes(g, s.flange);
    this.axes(g, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]);
  }

  // Names of cameras and targets, each below the last one that it would cover.
  names(g, things) {
    g.font = `${12 * this.ratio}px system-ui, "DejaVu Sans", sans-serif`;
    const taken = [], high = 14 * this.ratio;
    for (const thing of things) {
      let [x, y] = this.project([thing.pose[3], thing.pose[7], thing.pose[11]]);
      const wide = g.measureText(thing.name).width + 6 * this.ratio;
      x = Math.min(Math.max(x + 10 * this.ratio, 0), this.canvas.width - wide);
      while (taken.some(([a, b, w]) => x < a + w && a < x + wide && Math.abs(y - b) < high)) y += high;
      taken.push([x, y, wide]);
      g.fillStyle = "rgba(255,255,255,.85)"; g.fillRect(x - 3 * this.ratio, y - high * 0.8, wide, high);
      g.fillStyle = "#16202b"; g.fillText(thing.name, x, y);
    }
  }

  // Floor and candidates stay as painted until the cell is turned or they change: thousands take their time.
  background(g, w, h) {
    const drawnFor = [w, h, this.azimuth, this.elevation, this.k, ...this.middle].join();
    if (this.behind?.drawnFor !== drawnFor || this.behind.candidates !== this.candidates) {
      const canvas = Object.assign(document.createElement("canvas"), { width: w, height: h }), b = canvas.getContext("2d");
      b.lineJoin = b.lineCap = "round"; b.lineWidth = 1.2 * this.ratio;
      this.placed = [];
      this.floor(b);
      this.clouds(b);
      this.behind = { canvas, drawnFor, candidates: this.candidates, placed: this.placed };
    }
    g.drawImage(this.behind.canvas, 0, 0);
    this.placed = [...this.behind.placed];
  }

  floor(g) {
    g.strokeStyle = "#dde4ea"; g.beginPath();
    const n = 5, step = Math.max(0.1, Math.round(this.reach * 4) / 10 / 2) , x0 = Math.round(this.middle[0] / step) * step, y0 = Math.round(this.middle[1] / step) * step;
    for (let i = -n; i <= n; i++) {
      this.path(g, [[x0 + i * step, y0 - n * step, 0], [x0 + i * step, y0 + n * step, 0]]);
      this.path(g, [[x0 - n * step, y0 + i * step, 0], [x0 + n * step, y0 + i * step, 0]]);
    }
    g.stroke();
  }

  // Candidates: all of one colour in one stroke, or five thousand would take too long.
  clouds(g) {
    const c = this.candidates;
    if (!c) return;
    g.lineWidth = this.ratio;
    g.strokeStyle = "rgba(138,151,163,.55)"; g.beginPath();
    const r = 2.2 * this.ratio;
    c.ruled_out.forEach((m, i) => {
      const [x, y] = this.project([m[3], m[7], m[11]]);
      g.moveTo(x - r, y - r); g.lineTo(x + r, y + r); g.moveTo(x - r, y + r); g.lineTo(x + r, y - r);
      this.placed.push([x, y, `ruled out: ${c.reasons[c.reason_of[i]]}`]);
    });
    g.stroke();
    const size = (c.poses.length > 1500 ? 0.02 : 0.033) * this.reach, buckets = Array.from({ length: 8 }, () => []);
    c.gains.forEach((gain, i) => buckets[gain === null ? 0 : Math.round(7 * this.share(gain))].push(i));
    buckets.forEach((bucket, b) => {
      g.strokeStyle = colour(b / 7); g.globalAlpha = 0.35 + 0.6 * b / 7; g.beginPath();
      for (const i of bucket) this.outline(g, c.poses[i], c.sight, size, `${c.names[i]}: gain ${c.gains[i]?.toFixed(3) ?? "unknown"}`);
      g.stroke();
    });
    g.globalAlpha = 1;
  }
  share(gain) { return this.high > this.low ? (gain - this.low) / (this.high - this.low) : 1; }

  solid(items, frames, ghost) {
    if (!frames) return;
    for (const link of this.model.links) {
      const m = frames[link.frame], v = link.vertices, placed = [], world = [];
      for (let i = 0; i < v.length; i += 3) { const p = mul(m, [v[i], v[i + 1], v[i + 2]]); world.push(p); placed.push(this.project(p)); }
      for (let i = 0; i < link.faces.length; i += 3) {
        const [a, b, c] = [link.faces[i], link.faces[i + 1], link.faces[i + 2]], A = placed[a], B = placed[b], C = placed[c];
        const facing = (B[0] - A[0]) * (C[1] - A[1]) - (B[1] - A[1]) * (C[0] - A[0]);
        if (ghost && facing > 0) continue;
        const n = normal(world[a], world[b], world[c]), light = 0.5 + 0.5 * Math.abs(0.35 * n[0] - 0.25 * n[1] + 0.9 * n[2]);
        const fill = ghost ? "rgba(208,102,10,.13)" : `rgb(${[176, 190, 204].map((q) => Math.round(q * light)).join(",")})`;
        items.push({ near: (A[2] + B[2] + C[2]) / 3 - (ghost ? 0.02 : 0), paint: (g) => {
          g.fillStyle = fill; g.beginPath(); g.moveTo(A[0], A[1]); g.lineTo(B[0], B[1]); g.lineTo(C[0], C[1]); g.closePath(); g.fill();
          if (!ghost) { g.strokeStyle = fill; g.lineWidth = 0.6; g.stroke(); }
        } });
      }
    }
  }

  board(items, board) {
    const [lx, ly] = board.low, [hx, hy] = board.high, px = 0.12 * (hx - lx) + 0.005, py = 0.12 * (hy - ly) + 0.005;
    const corners = [[lx - px, ly - py, 0], [hx + px, ly - py, 0], [hx + px, hy + py, 0], [lx - px, hy + py, 0]].map((p) => this.project(mul(board.pose, p)));
    const dots = board.points.map((p) => this.project(mul(board.pose, p)));
    items.push({ near: corners.reduce((s, c) => s + c[2], 0) / 4, paint: (g) => {
      g.fillStyle = "#fff"; g.strokeStyle = "#16202b"; g.lineWidth = 1.2 * this.ratio; g.beginPath();
      corners.forEach((c, i) => (i ? g.lineTo(c[0], c[1]) : g.moveTo(c[0], c[1]))); g.closePath(); g.fill(); g.stroke();
      g.fillStyle = "#16202b";
      for (const d of dots) g.fillRect(d[0] - this.ratio, d[1] - this.ratio, 2 * this.ratio, 2 * this.ratio);
    } });
  }

  outline(g, pose, sight, size, name) {
    const inHand = Boolean(sight), [ox, oy] = sight ?? [0, 0];
    const at = this.project([pose[3], pose[7], pose[11]]);
    this.placed.push([at[0], at[1], name]);
    // A camera is a pyramid that opens along z; a target a square with its normal.
    const z = inHand ? size : 0, ex = inHand ? ox * size : size * 0.7, ey = inHand ? oy * size : size * 0.5;
    const c = [[-ex, -ey, z], [ex, -ey, z], [ex, ey, z], [-ex, ey, z]].map((p) => this.project(mul(pose, p)));
    g.moveTo(c[3][0], c[3][1]);
    for (const p of c) g.lineTo(p[0], p[1]);
    for (const p of inHand ? c : [this.project(mul(pose, [0, 0, -size]))]) { g.moveTo(at[0], at[1]); g.lineTo(p[0], p[1]); }
  }
  frustum(g, thing, size, stroke, width, name) {
    g.strokeStyle = stroke; g.lineWidth = width * this.ratio; g.beginPath(); this.outline(g, thing.pose, thing.sight, size, name); g.stroke();
  }

  ellipsoid(g, e) {
    g.strokeStyle = "#a3007a"; g.lineWidth = 1.6 * this.ratio; g.beginPath();
    for (const [i, j] of [[0, 1], [0, 2], [1, 2]]) {
      const ring = [];
      for (let t = 0; t <= 32; t++) {
        const c = Math.cos(t * Math.PI / 16), s = Math.sin(t * Math.PI / 16);
        ring.push(e.middle.map((m, k) => m + c * e.axes[i][k] + s * e.axes[j][k]));
      }
      this.path(g, ring);
    }
    g.stroke();
    const [x, y] = this.project(e.middle);
    this.placed.push([x, y, `95 % ellipsoid of ${e.name}: longest half axis ${e.longest_mm.toPrecision(2)} mm, drawn ${e.magnification} times larger`]);
  }
  axes(g, m) {
    [["#b3140f", 0], ["#1a6f3c", 1], ["#0b5cad", 2]].forEach(([stroke, axis]) => {
      const p = [0, 0, 0]; p[axis] = 0.09 * this.reach;
      g.strokeStyle = stroke; g.lineWidth = 2 * this.ratio; g.beginPath(); this.path(g, [mul(m, [0, 0, 0]), mul(m, p)]); g.stroke();
    });
  }
  path(g, points) { points.forEach((p, i) => { const [x, y] = this.project(p); i ? g.lineTo(x, y) : g.moveTo(x, y); }); }

  hover(x, y) {
    let best = 12 * this.ratio, text = "";
    for (const [px, py, name] of this.placed) {
      const d = Math.hypot(px - x * this.ratio, py - y * this.ratio);
      if (d <= best) { best = d; text = name; }
    }
    this.tip.hidden = !text; this.tip.textContent = text;
  }
}

function normal(a, b, c) {
  const u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
  const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]], l = Math.hypot(...n) || 1;
  return n.map((q) => q / l);
}
