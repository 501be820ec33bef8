"use strict";
// The trajectory model in double precision, with the formulas of the engine's verdict but without its rounding margin:
// good for looking, not a proof.

function makeModel(data) {
  const T = data.steps, nP = 2, { weights, biases } = data.network;
  const shapeOf = data.tube.edges.map((e) => e.length - 1);
  const widthsOf = new Map(), cornersOf = new Map(); // by the bins that contain k
  const polytopesOf = new Map(); // by cell
  data.polytopes.forEach((polytope, i) => {
    const cell = polytope.pattern + "/" + polytope.bin;
    if (!polytopesOf.has(cell)) polytopesOf.set(cell, []);
    polytopesOf.get(cell).push(i);
  });

  function forward(k) {
    let x = k, pattern = "";
    for (let l = 0; l < weights.length; l++) {
      const out = new Array(biases[l].length), last = l === weights.length - 1;
      for (let i = 0; i < out.length; i++) {
        const row = weights[l][i];
        let sum = biases[l][i];
        for (let j = 0; j < row.length; j++) sum += row[j] * x[j];
        if (!last) { pattern += sum > 0 ? "1" : "0"; if (!(sum > 0)) sum = 0; }
        out[i] = sum;
      }
      x = out;
    }
    return { y: x, pattern };
  }

  // numbers of the closed bins that contain k: none outside K, several on a border between bins
  function binsOf(k) {
    let numbers = [0];
    for (let axis = 0; axis < k.length; axis++) {
      const edge = data.tube.edges[axis], holding = [];
      if (!(k[axis] >= data.domain.lo[axis] && k[axis] <= data.domain.hi[axis])) return [];
      for (let i = 0; i < edge.length - 1; i++) if (k[axis] >= edge[i] && k[axis] <= edge[i + 1]) holding.push(i);
      numbers = numbers.flatMap((number) => holding.map((i) => number * shapeOf[axis] + i));
    }
    return numbers;
  }

  // half widths of the tube that count there: the widest of all bins
  function widths(bins) {
    const key = bins.join();
    if (!widthsOf.has(key)) {
      const widest = (a, b) => a.map((v, i) => (Array.isArray(v) ? widest(v, b[i]) : Math.max(v, b[i])));
      const of = (part) => bins.map((bin) => data.tube[part][bin]).reduce(widest);
      widthsOf.set(key, { interval: of("interval"), final: of("final") });
    }
    return widthsOf.get(key);
  }

  function plan(p0, k) {
    const { y, pattern } = forward(k), path = [[p0[0], p0[1]]];
    for (let t = 0; t < T; t++) path.push([p0[0] + y[t * nP], p0[1] + y[t * nP + 1]]);
    const bins = binsOf(k);
    return { path, q: y.slice(T * nP), pattern, bins, widths: bins.length ? widths(bins) : null };
  }

  // corners of every obstacle grown by polygon body and tube, per interval: [obstacle][interval] -> [[x, y], ...]
  function grown(seen) {
    const key = seen.bins.join();
    if (!cornersOf.has(key))
      cornersOf.set(key, data.obstacles.map((o) => seen.widths.interval.map((e) =>
        o.corner.map((c, i) => [c[0] + o.sign[i][0] * e[0], c[1] + o.sign[i][1] * e[1]]))));
    return cornersOf.get(key);
  }

  // largest gap over edge normals, the segment's normals and the direction from the nearest corner
  function separation(a, b, corners) {
    const dx = b[0] - a[0], dy = b[1] - a[1], length2 = dx * dx + dy * dy;
    let best = -Infinity, w = [1, 0], near = Infinity, nx = 0, ny = 0;
    const look = (ux, uy) => {
      const size = Math.hypot(ux, uy);
      if (!(size > 0)) return;
      ux /= size; uy /= size;
      let reach = -Infinity;
      for (const c of corners) reach = Math.max(reach, ux * c[0] + uy * c[1]);
      const gap = Math.min(ux * a[0] + uy * a[1], ux * b[0] + uy * b[1]) - reach;
      if (gap > best) { best = gap; w = [ux, uy]; }
    };
    for (let i = 0; i < corners.length; i++) {
      const c = corners[i], d = corners[(i + 1) % corners.length];
      look(d[1] - c[1], c[0] - d[0]);
      const share = length2 > 0 ? Math.min(1, Math.max(0, ((c[0] - a[0]) * dx + (c[1] - a[1]) * dy) / length2)) : 0;
      const ox = a[0] + share * dx - c[0], oy = a[1] + share * dy - c[1], far = ox * ox + oy * oy;
      if (far < near) { near = far; nx = ox; ny = oy; }
    }
    look(-dy, dx); look(dy, -dx); look(nx, ny);
    return { gap: best - data.radius, w };
  }

  function rowMargin(rows, x, lost) {
    let least = Infinity, worst = -1;
    rows.b.forEach((b, i) => {
      let value = b;
      rows.A[i].forEach((a, j) => { value -= a * x[j] + Math.abs(a) * lost[j]; });
      if (value < least) { least = value; worst = i; }
    });
    return { least, worst };
  }

  const active = (o, t) => t >= data.obstacles[o].steps[0] && t <= data.obstacles[o].steps[1];

  function goalMargin(seen) {
    if (!seen.widths) return { least: -Infinity, worst: -1 };
    return rowMargin(data.goal, [...seen.path[T], ...seen.q], seen.widths.final);
  }

  function verdict(p0, k) {
    const seen = plan(p0, k), goal = goalMargin(seen);
    const start = data.start ? rowMargin(data.start, p0, [0, 0]).least : Infinity;
    const gaps = data.obstacles.map(() => new Array(T).fill(NaN));
    let clearance = Infinity, worst = null;
    if (seen.widths) {
      const corners = grown(seen);
      data.obstacles.forEach((_, o) => {
        for (let t = 0; t < T; t++) {
          if (!active(o, t)) continue;
          gaps[o][t] = separation(seen.path[t], seen.path[t + 1], corners[o][t]).gap;
          if (gaps[o][t] < clearance) { clearance = gaps[o][t]; worst = [o, t]; }
        }
      });
    }
    const reaches = goal.least >= 0 && start >= 0;
    const polytope = reaches ? polytopeAround(seen) : -1, corridor = reaches ? corridorAround(seen) : -1;
    return { ...seen, goal, start, gaps, clearance, worst, reaches, safe: reaches && clearance > 0, polytope, corridor };
  }

  // number of a returned polytope that holds this plan, -1 for none: polytopes are open at the borders between bins
  function polytopeAround(seen) {
    if (seen.bins.length !== 1) return -1;
    const mine = polytopesOf.get(seen.pattern + "/" + seen.bins[0]) || [];
    return mine.find((i) => keeps(data.polytopes[i].sep, seen)) ?? -1;
  }

  // number of a returned corridor that this plan keeps to, -1 for none; the widest widths count
  const corridorAround = (seen) => data.corridors.findIndex((corridor) => keeps(corridor.sep, seen));

  // does every run of these directions (by number) leave room around the plan?
  const keeps = (sep, seen) => data.directions[sep].every((runs) => runs.every((run) => runMargin(run, seen) > 0));

  // room [m] that a run of a certificate leaves around a plan
  function runMargin([first, end, wx, wy, reach], seen) {
    let least = Infinity;
    for (let t = first; t < end; t++) {
      const e = seen.widths.interval[t], a = seen.path[t], b = seen.path[t + 1];
      const need = reach + Math.abs(wx) * e[0] + Math.abs(wy) * e[1];
      least = Math.min(least, wx * a[0] + wy * a[1] - need, wx * b[0] + wy * b[1] - need);
    }
    return least / Math.hypot(wx, wy);
  }

  // 2: proved, in a returned corridor or polytope; 1: safe for this page's arithmetic alone; 0: not shown safe
  function level(p0, k) {
    const seen = plan(p0, k);
    if (!(goalMargin(seen).least >= 0)) return 0;
    if (data.start && !(rowMargin(data.start, p0, [0, 0]).least >= 0)) return 0;
    if (!touchesNothing(seen)) return 0;
    return corridorAround(seen) >= 0 || polytopeAround(seen) >= 0 ? 2 : 1;
  }

  function touchesNothing(seen) {
    const corners = grown(seen);
    for (let o = 0; o < data.obstacles.length; o++)
      for (let t = 0; t < T; t++)
        if (active(o, t) && !farApart(seen.path[t], seen.path[t + 1], corners[o][t])
            && !(separation(seen.path[t], seen.path[t + 1], corners[o][t]).gap > 0)) return false;
    return true;
  }

  function farApart(a, b, corners) {
    for (let axis = 0; axis < 2; axis++) {
      let lo = Infinity, hi = -Infinity;
      for (const c of corners) { lo = Math.min(lo, c[axis]); hi = Math.max(hi, c[axis]); }
      if (Math.min(a[axis], b[axis]) > hi + data.radius || Math.max(a[axis], b[axis]) < lo - data.radius) return true;
    }
    return false;
  }

  return { T, plan, verdict, level, grown, separation, runMargin, active };
}
