// Drawing of the scene, the parameters and the clearance of an answer's page.

// hexagon that an error set sweeps along a segment
const sweep = (a, b, errors) => hull(sums([a, b], errors));

const FOOTPRINTS = 8; // of the body along the path

// one side of the workspace; `of` is where a place is seen
function drawScene(view, data, model, state) {
  const { seen, t } = state, interval = Math.min(t, model.T - 1), { number } = view, of = (place) => view.axes.map((a) => place[a]);
  const outlineOf = ({ points, shape, radius }, places) => swell(sums(points.map((i) => of(places[i])), shape.map(of)), radius);
  view.clear();
  for (const outline of data.outlines[view.axes.join()]) view.shape(outline, { fill: "#fbe3b0" });
  if (model.single) drawGrown(view, data, model, state, of);
  for (const goal of data.goals) view.shape(goal.outlines[number], { fill: "rgba(0,158,115,.25)", stroke: INK.green, width: 1.5 });
  data.obstacles.forEach(({ outlines }, o) => {
    const exists = model.pairs.some((pair) => pair.obstacle === o && model.active(pair, interval));
    const looks = exists ? { fill: data.n_p === 2 ? "#6e6e6e" : "rgba(110,110,110,.6)" } : { stroke: INK.grey, dash: [5, 4] };
    view.shape(outlines[number], looks);
    const [x, y] = view.px([0, 1].map((a) => outlines[number].reduce((sum, v) => sum + v[a], 0) / outlines[number].length));
    view.text(String(o), x, y + 4, "center", exists ? "#fff" : INK.grey);
  });
  if (seen.tube)
    for (let i = 0; i < model.T; i++)
      data.points.forEach((_, point) => {
        const errors = seen.tube.errors[i][point].map(of), [a, b] = [seen.path[i], seen.path[i + 1]].map((places) => of(places[point]));
        view.shape(sweep(a, b, errors), { fill: "#cfe4f3", stroke: "#cfe4f3" });
      });
  drawCells(view, state.starts[number] || []);
  for (const s of data.samples) view.dot(of(s.p0), 2.2, "#b8860b", "rgba(255,255,255,.6)");
  if (!model.single)
    for (let shown = 0; shown <= FOOTPRINTS; shown++) {
      const places = seen.path[Math.round((shown * model.T) / FOOTPRINTS)];
      for (const part of data.parts) view.shape(outlineOf(part, places), { stroke: "rgba(0,114,178,.35)" });
    }
  view.shape(seen.path.map((places) => of(places[0])), { stroke: INK.blue, width: 2, open: true });
  for (const part of data.parts) {
    const now = { fill: model.single ? "rgba(0,114,178,.12)" : "rgba(86,180,233,.55)", stroke: INK.blue, width: 1.5 };
    view.shape(outlineOf(part, seen.path[t]), now);
    if (seen.tube && !model.single) {
      const places = model.swept(seen, part.points, interval).map(of);
      view.shape(swell(sums(places, part.shape.map(of)), part.radius), { stroke: INK.red });
    }
  }
  const here = of(seen.path[t][0]);
  if (seen.tube && model.single) view.shape(sweep(here, here, seen.tube.errors[interval][0].map(of)), { stroke: INK.blue });
  drawSeparators(view, data, model, state, interval);
  view.dot(here, 3, INK.blue);
  view.dot(of(seen.path[0][0]), 7, INK.orange);
  view.ticks(...view.axes.map((a) => data.labels.p[a]));
  if (data.views.length > 1) view.text(data.views[number].name, view.w / 2, 12, "center");
}

// obstacles around the path of a body with one point: grown by the body, and by the tube while they exist
function drawGrown(view, data, model, state, of) {
  const { seen, t } = state, interval = Math.min(t, model.T - 1);
  for (const { corners, radius } of model.pairs) view.shape(swell(corners.map(of), radius), { fill: "#ececec", stroke: INK.grey, dash: [5, 4] });
  if (!seen.tube) return;
  for (const pair of model.pairs)
    if (model.active(pair, interval)) {
      const around = sums(pair.corners, seen.tube.errors[interval][pair.points[0]]).map(of);
      view.shape(swell(around, pair.radius), { fill: "rgba(213,94,0,0.10)", stroke: INK.red });
    }
}

// cells of a grid: proved ones full, those that only this page computed pale
function drawCells(view, cells) {
  for (const { corners, level } of cells) view.shape(corners, { fill: level === 2 ? "rgba(0,158,115,.75)" : "rgba(204,121,167,.75)" });
}

const STEEP = 0.3; // a plane that is seen nearly from its face has no line here

// what the certificate puts between body and obstacle now: w . p = support of obstacle and shape; in space where the
// plane meets the depth of the pair's nearest point
function drawSeparators(view, data, model, state, interval) {
  if (state.directions < 0) return;
  const size = Math.hypot(view.hi[0] - view.lo[0], view.hi[1] - view.lo[1]);
  data.directions[state.directions].forEach((runs, number) => {
    const pair = model.pairs[number];
    for (const [first, end, w, support] of runs) {
      const seen = view.axes.map((a) => w[a]), n2 = dot(seen, seen);
      if (interval < first || interval >= end || n2 < (STEEP * Math.hypot(...w)) ** 2) continue;
      const place = farthest(pair.points.map((i) => state.seen.path[interval][i]), w, -1), here = view.axes.map((a) => place[a]);
      const shift = (support - dot(w, place)) / n2, foot = here.map((v, a) => v + shift * seen[a]);
      const along = [-seen[1], seen[0]].map((v) => (v * size) / Math.sqrt(n2));
      view.shape([minus(foot, along), plus(foot, along)], { stroke: lineOf(pair.obstacle), dash: [3, 4], open: true });
    }
  });
}

function drawParameters(view, data, state) {
  const [i, j] = state.axes, outlines = data.outlines[`${data.n_p + i},${data.n_p + j}`] || [];
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
}
