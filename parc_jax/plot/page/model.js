"use strict";
// The trajectory model in double precision, with the formulas of the engine's verdict but without its rounding margin:
// good for looking, not a proof.

function makeModel(data) {
  const T = data.steps, nP = 2, { weights, biases } = data.network;
  const shapeOf = data.tube.edges.map((e) => e.length - 1);
  const cornersOfBin = new Map();
  const setsOf = new Map();
  data.sets.forEach((s, i) => {
    const cell = s.pattern + "/" + s.bin;
    if (!setsOf.has(cell)) setsOf.set(cell, []);
    setsOf.get(cell).push(i);
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

  // -1 outside K and on a border between bins, where two tubes would have to hold
  function binOf(k) {
    let number = 0;
    for (let axis = 0; axis < k.length; axis++) {
      const edge = data.tube.edges[axis], last = edge.length - 1;
      if (!(k[axis] >= edge[0] && k[axis] <= edge[last])) return -1;
      let cell = 0;
      while (cell < last - 1 && k[axis] >= edge[cell + 1]) cell++;
      if (cell > 0 && k[axis] === edge[cell]) return -1;
      number = number * shapeOf[axis] + cell;
    }
    return number;
  }

  function plan(p0, k) {
    const { y, pattern } = forward(k), path = [[p0[0], p0[1]]];
    for (let t = 0; t < T; t++) path.push([p0[0] + y[t * nP], p0[1] + y[t * nP + 1]]);
    return { path, q: y.slice(T * nP), pattern, bin: binOf(k) };
  }

  // corners of every obstacle grown by polygon body and tube, per interval: [obstacle][interval] -> [[x, y], ...]
  function grown(bin) {
    if (!cornersOfBin.has(bin)) {
      const error = data.tube.interval[bin];
      cornersOfBin.set(bin, data.obstacles.map((o) => error.map((e) =>
        o.corner.map((c, i) => [c[0] + o.sign[i][0] * e[0], c[1] + o.sign[i][1] * e[1]]))));
    }
    return cornersOfBin.get(bin);
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
    if (seen.bin < 0) return { least: -Infinity, worst: -1 };
    return rowMargin(data.goal, [...seen.path[T], ...seen.q], data.tube.final[seen.bin]);
  }

  function verdict(p0, k) {
    const seen = plan(p0, k), goal = goalMargin(seen);
    const start = data.start ? rowMargin(data.start, p0, [0, 0]).least : Infinity;
    const gaps = data.obstacles.map(() => new Array(T).fill(NaN));
    let clearance = Infinity, worst = null;
    if (seen.bin >= 0) {
      const corners = grown(seen.bin);
      data.obstacles.forEach((_, o) => {
        for (let t = 0; t < T; t++) {
          if (!active(o, t)) continue;
          gaps[o][t] = separation(seen.path[t], seen.path[t + 1], corners[o][t]).gap;
          if (gaps[o][t] < clearance) { clearance = gaps[o][t]; worst = [o, t]; }
        }
      });
    }
    const reaches = goal.least >= 0 && start >= 0;
    return { ...seen, goal, start, gaps, clearance, worst, reaches, safe: reaches && clearance > 0, set: setAround(seen, reaches) };
  }

  // number of a returned set whose certificate separates this plan, -1 if there is none
  function setAround(seen, reaches) {
    if (!reaches) return -1;
    for (const i of setsOf.get(seen.pattern + "/" + seen.bin) || [])
      if (data.sets[i].sep.every((runs) => runs.every((run) => runMargin(run, seen) > 0))) return i;
    return -1;
  }

  // room [m] that a run of a certificate leaves around a plan
  function runMargin([first, end, wx, wy, reach], seen) {
    let least = Infinity;
    for (let t = first; t < end; t++) {
      const e = data.tube.interval[seen.bin][t], a = seen.path[t], b = seen.path[t + 1];
      const need = reach + Math.abs(wx) * e[0] + Math.abs(wy) * e[1];
      least = Math.min(least, wx * a[0] + wy * a[1] - need, wx * b[0] + wy * b[1] - need);
    }
    return least / Math.hypot(wx, wy);
  }

  // the verdict alone, leaving at the first failure
  function isSafe(p0, k) {
    const seen = plan(p0, k);
    if (!(goalMargin(seen).least >= 0)) return false;
    if (data.start && !(rowMargin(data.start, p0, [0, 0]).least >= 0)) return false;
    const corners = grown(seen.bin);
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

  return { T, plan, verdict, isSafe, grown, separation, runMargin, active };
}
