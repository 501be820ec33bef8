// Drawing. A View maps data to the pixels of one canvas.

const INK = { blue: "#0072b2", orange: "#e69f00", green: "#009e73", red: "#d55e00", grey: "#8c8c8c", black: "#222" };

const LINES = [INK.blue, INK.red, INK.green, INK.black, INK.orange, INK.grey];
const lineOf = (o) => LINES[o % LINES.length];

class View {
  constructor(canvas, equal, pad) {
    this.canvas = canvas; this.equal = equal; this.pen = canvas.getContext("2d");
    this.lo = [0, 0]; this.hi = [1, 1]; this.pad = pad; // [pixels] left and right, above and below
  }
  show(lo, hi) { this.lo = lo.slice(); this.hi = hi.slice(); this.fit(); }
  fit() {
    const ratio = window.devicePixelRatio || 1, { clientWidth: w, clientHeight: h } = this.canvas;
    this.canvas.width = w * ratio; this.canvas.height = h * ratio;
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.w = w; this.h = h;
    let sx = (w - 2 * this.pad[0]) / (this.hi[0] - this.lo[0]), sy = (h - 2 * this.pad[1]) / (this.hi[1] - this.lo[1]);
    if (this.equal) sx = sy = Math.min(sx, sy);
    this.scale = [sx, sy];
    this.middle = [(this.lo[0] + this.hi[0]) / 2, (this.lo[1] + this.hi[1]) / 2];
  }
  px(p) { return [this.w / 2 + (p[0] - this.middle[0]) * this.scale[0], this.h / 2 - (p[1] - this.middle[1]) * this.scale[1]]; }
  at(x, y) { return [this.middle[0] + (x - this.w / 2) / this.scale[0], this.middle[1] - (y - this.h / 2) / this.scale[1]]; }
  clear() { this.pen.clearRect(0, 0, this.w, this.h); }
  shape(points, { fill, stroke, width = 1, dash = [], open = false } = {}) {
    const pen = this.pen;
    pen.beginPath();
    points.forEach((p, i) => { const [x, y] = this.px(p); if (i) pen.lineTo(x, y); else pen.moveTo(x, y); });
    if (!open) pen.closePath();
    if (fill) { pen.fillStyle = fill; pen.fill(); }
    if (stroke) { pen.strokeStyle = stroke; pen.lineWidth = width; pen.setLineDash(dash); pen.stroke(); pen.setLineDash([]); }
  }
  dot(p, radius, fill, stroke = "#fff") {
    const [x, y] = this.px(p), pen = this.pen;
    pen.beginPath(); pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fillStyle = fill; pen.fill(); pen.strokeStyle = stroke; pen.lineWidth = 1; pen.stroke();
  }
  text(words, x, y, align = "left", color = "#555") {
    this.pen.fillStyle = color; this.pen.font = "11px system-ui, sans-serif"; this.pen.textAlign = align;
    this.pen.fillText(words, x, y);
  }
  ticks(unitX, unitY) {
    const far = [this.at(0, this.h), this.at(this.w, 0)];
    for (const axis of [0, 1]) {
      const step = niceStep((far[1][axis] - far[0][axis]) / 6);
      for (let v = Math.ceil(far[0][axis] / step) * step; v < far[1][axis]; v += step) {
        const [x, y] = this.px(axis ? [this.middle[0], v] : [v, this.middle[1]]);
        const label = String(Number(v.toPrecision(6)));
        if (axis === 0 && x > 40 && x < this.w - 48) this.text(label, x, this.h - 4, "center");
        if (axis === 1 && y > 20 && y < this.h - 16) this.text(label, 3, y + 4);
      }
    }
    this.text(unitX, this.w - 4, this.h - 4, "right");
    this.text(unitY, 3, 11);
  }
}

function niceStep(rough) {
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((m) => m * power >= rough);
}

// a convex polygon swelled by a disc, as a dense outline
function swell(corners, radius) {
  const points = [];
  for (const c of corners)
    for (let i = 0; i < (radius > 0 ? 40 : 1); i++) {
      const angle = (i * 2 * Math.PI) / 40;
      points.push([c[0] + radius * Math.cos(angle), c[1] + radius * Math.sin(angle)]);
    }
  return hull(points);
}

function hull(points) {
  const sorted = points.slice().sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const out = [];
    for (const p of list) {
      while (out.length > 1) {
        const a = out[out.length - 2], b = out[out.length - 1];
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        out.pop();
      }
      out.push(p);
    }
    return out.slice(0, -1);
  };
  return sorted.length < 3 ? sorted : [...half(sorted), ...half(sorted.reverse())];
}

// hexagon that an error box sweeps along a segment
function sweep(a, b, e) {
  const box = (p) => [[p[0] - e[0], p[1] - e[1]], [p[0] + e[0], p[1] - e[1]], [p[0] + e[0], p[1] + e[1]], [p[0] - e[0], p[1] + e[1]]];
  return hull([...box(a), ...box(b)]);
}

function drawScene(view, data, model, state) {
  const { seen, t } = state, interval = Math.min(t, model.T - 1);
  view.clear();
  for (const outline of data.outlines["0,1"]) view.shape(outline, { fill: "#fbe3b0" });
  for (const o of data.obstacles) view.shape(swell(o.corner, data.radius), { fill: "#ececec", stroke: INK.grey, dash: [5, 4] });
  if (seen.widths) {
    const corners = model.grown(seen);
    data.obstacles.forEach((_, o) => {
      if (model.active(o, interval))
        view.shape(swell(corners[o][interval], data.radius), { fill: "rgba(213,94,0,0.10)", stroke: INK.red });
    });
  }
  view.shape(data.goal_outline, { fill: "#bfe5d8", stroke: INK.green, width: 1.5 });
  data.obstacles.forEach((o, number) => {
    view.shape(o.outline, { fill: "#6e6e6e" });
    const [x, y] = view.px([0, 1].map((a) => o.outline.reduce((sum, v) => sum + v[a], 0) / o.outline.length));
    view.text(String(number), x, y + 4, "center", "#fff");
  });
  if (seen.widths)
    for (let i = 0; i < model.T; i++)
      view.shape(sweep(seen.path[i], seen.path[i + 1], seen.widths.interval[i]), { fill: "#cfe4f3", stroke: "#cfe4f3" });
  drawCells(view, state.starts);
  for (const s of data.samples) view.dot(s.p0, 2.2, "#b8860b", "rgba(255,255,255,.6)");
  view.shape(seen.path, { stroke: INK.blue, width: 2, open: true });
  const here = seen.path[t];
  view.shape(data.body.map((v) => [here[0] + v[0], here[1] + v[1]]), { fill: "rgba(0,114,178,.12)", stroke: INK.blue, width: 1.5 });
  if (seen.widths) view.shape(sweep(here, here, seen.widths.interval[interval]), { stroke: INK.blue });
  drawSeparators(view, data, state, interval);
  view.dot(here, 3, INK.blue);
  view.dot(seen.path[0], 7, INK.orange);
  view.ticks(...data.labels.p);
}

// cells of a grid: proved ones full, those that only this page computed pale
function drawCells(view, cells) {
  for (const { corners, level } of cells) view.shape(corners, { fill: level === 2 ? "rgba(0,158,115,.75)" : "rgba(204,121,167,.75)" });
}

// the line that the certificate puts between tube and obstacle now: w . p = reach of obstacle and body
function drawSeparators(view, data, state, interval) {
  if (state.directions < 0) return;
  const size = Math.hypot(view.hi[0] - view.lo[0], view.hi[1] - view.lo[1]);
  data.directions[state.directions].forEach((runs, o) => {
    for (const [first, end, wx, wy, reach] of runs) {
      if (interval < first || interval >= end) continue;
      const n2 = wx * wx + wy * wy, here = state.seen.path[interval], shift = (reach - (wx * here[0] + wy * here[1])) / n2;
      const foot = [here[0] + shift * wx, here[1] + shift * wy], along = [(-wy * size) / Math.sqrt(n2), (wx * size) / Math.sqrt(n2)];
      const line = [[foot[0] - along[0], foot[1] - along[1]], [foot[0] + along[0], foot[1] + along[1]]];
      view.shape(line, { stroke: lineOf(o), dash: [3, 4], open: true });
    }
  });
}

function drawParameters(view, data, state) {
  const [i, j] = state.axes, outlines = data.outlines[`${2 + i},${2 + j}`] || [];
  view.clear();
  const { lo, hi } = data.domain, point = (k) => [k[i], i === j ? lo[j] + 0.5 : k[j]], top = i === j ? lo[j] + 1 : hi[j];
  view.shape([[lo[i], lo[j]], [hi[i], lo[j]], [hi[i], top], [lo[i], top]], { fill: "#f4f4f4", stroke: "#ccc" });
  for (const outline of outlines) view.shape(outline, { fill: "#bbddf2", stroke: "#8cc8ec", width: 0.5 });
  drawCells(view, state.cells);
  for (const s of data.samples) view.dot(point(s.k), 2, "#444", "rgba(255,255,255,.6)");
  view.dot(point(state.k), 7, INK.orange);
  view.ticks(data.labels.k[i], i === j ? "" : data.labels.k[j]);
}

function drawClearance(view, data, model, state) {
  const { gaps } = state.seen, bend = (g) => Math.asinh(g / 0.1), dt = data.dt;
  const top = Math.max(1, ...gaps.flat().filter(Number.isFinite).map(bend)), bottom = -0.8;
  view.show([0, bottom], [model.T * dt, top]);
  view.clear();
  const level = (v, color) => view.shape([[0, v], [model.T * dt, v]], { stroke: color, open: true });
  for (const g of [0.1, 1, 10]) if (bend(g) < top) { level(bend(g), "#e4e4e4"); view.text(`${g} m`, 3, view.px([0, bend(g)])[1] + 4); }
  level(0, INK.red);
  view.text("0", 3, view.px([0, 0])[1] + 4, "left", INK.red);
  gaps.forEach((gap, o) => {
    const line = gap.map((g, t) => [(t + 0.5) * dt, Math.max(bottom, bend(g))]).filter((p) => Number.isFinite(p[1]));
    view.shape(line, { stroke: lineOf(o), width: 1.6, dash: o >= LINES.length ? [4, 3] : [], open: true });
    if (o < LINES.length) view.text(`obstacle ${o}`, view.w - 6, 14 + 13 * o, "right", lineOf(o));
  });
  view.shape([[state.t * dt, bottom], [state.t * dt, top]], { stroke: INK.grey, open: true });
  view.text("clearance of the tube", view.w / 2, 12, "center");
}
