// The trajectory model in double precision, with the formulas of the engine's verdict but without its rounding margin:
// good for looking, not a proof. A path is [knot][reference point] -> place.

function makeModel(data) {
  const T = data.steps, nP = data.n_p, nPoints = data.points.length, { weights, biases } = data.network;
  const outputs = (T + 1) * nPoints * nP - nP; // offsets: the first point starts at p0 itself
  const shapeOf = data.tube.edges.map((e) => e.length - 1);
  const tubeOf = new Map(); // by the bins that contain k
  const polytopesOf = new Map(); // by cell
  data.polytopes.forEach((polytope, i) => {
    const cell = polytope.pattern + "/" + polytope.bin;
    if (!polytopesOf.has(cell)) polytopesOf.set(cell, []);
    polytopesOf.get(cell).push(i);
  });
  // what keeps apart: every obstacle with every part of the body, obstacle by obstacle
  const pairs = data.obstacles.flatMap(({ vertices, steps }, obstacle) => data.parts.map(({ shape }, part) => {
    const all = sums(vertices, shape.map((v) => v.map((x) => -x)));
    const corners = nP === 2 ? hull(all) : all;
    return { obstacle, part, steps, corners, box: around(corners), ...data.parts[part] };
  }));

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

  // numbers of the closed bins that contain k: none outside its box, several on a border between bins
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

  // corners of the errors that a bin allows a point in an interval
  function errorsIn(bin, t, i) {
    const { faces, interval } = data.tube;
    if (!faces) return boxCorners(interval[bin][t].slice(i * nP, (i + 1) * nP));
    return faceCorners(faces.directions[bin][t][i], faces.centre[bin][t][i], faces.half[bin][t][i]);
  }

  // the tube that counts there, of all bins together: corners of the errors of each point and the box around them by
  // interval, and what the rows of the goal lose
  function tube(bins) {
    const key = bins.join();
    if (!tubeOf.has(key)) {
      const errors = Array.from({ length: T }, (_, t) => data.points.map((_, i) => bins.flatMap((bin) => errorsIn(bin, t, i))));
      const lost = data.goal.b.map((_, row) => Math.max(...bins.map((bin) => data.tube.lost[bin][row])));
      tubeOf.set(key, { errors, boxes: errors.map((points) => points.map(around)), lost });
    }
    return tubeOf.get(key);
  }

  function plan(p0, k) {
    const { y, pattern } = forward(k), bins = binsOf(k), path = [];
    const offsets = [...new Array(nP).fill(0), ...y.slice(0, outputs)];
    for (let t = 0, next = 0; t <= T; t++) path.push(data.points.map(() => p0.map((v) => v + offsets[next++])));
    const claimed = bins.length && bins.every((bin) => data.tube.lost[bin]);
    return { path, q: y.slice(outputs), pattern, bins, tube: claimed ? tube(bins) : null };
  }

  // the places that the reference points of a part may take in an interval: corners of their hull
  const swept = (seen, points, t) => {
    const places = points.flatMap((i) => sums([seen.path[t][i], seen.path[t + 1][i]], seen.tube.errors[t][i]));
    return nP === 2 ? hull(places) : places;
  };

  const gapOf = (seen, pair, t) => separation(swept(seen, pair.points, t), pair.corners).gap - pair.radius;

  // least of b - A x - lost over rows, and the row
  function rowMargin({ A, b }, x, lost) {
    const margins = b.map((bound, i) => bound - dot(A[i], x) - lost[i]), least = Math.min(...margins);
    return { least, worst: margins.indexOf(least) };
  }

  const active = ({ steps: [first, last] }, t) => t >= first && t <= last;

  function goalMargin(seen) {
    if (!seen.tube) return { least: -Infinity, worst: -1 };
    return rowMargin(data.goal, [...seen.path[T].flat(), ...seen.q], seen.tube.lost);
  }

  // does the predicted end lie in the goal, whatever of its tube does not?
  const ends = (seen) => rowMargin(data.goal, [...seen.path[T].flat(), ...seen.q], data.goal.b.map(() => 0)).least >= 0;

  // less what rounding takes of each row, as in the engine's verdict: without it nothing is called proved
  const surely = (seen, p0) => [[data.goal, [...seen.path[T].flat(), ...seen.q], seen.tube.lost],
    ...(data.start ? [[data.start, p0, data.start.b.map(() => 0)]] : [])].every(([rows, x, lost], n) =>
    rowMargin(rows, x, lost.map((own, i) => own + data.rounding[n][i])).least >= 0);

  // an answer from one start has no start set, and free space was looked up there alone: of other starts nothing is said
  const startMargin = (p0) => (data.at && p0.some((v, i) => v !== data.at[i]) ? -Infinity : data.start ? rowMargin(data.start, p0, data.start.b.map(() => 0)).least : Infinity);

  // gaps: [obstacle][interval], of the part that is nearest
  function verdict(p0, k) {
    const seen = plan(p0, k), goal = goalMargin(seen), start = startMargin(p0);
    const gaps = data.obstacles.map(() => new Array(T).fill(NaN));
    let clearance = Infinity, worst = null;
    for (const pair of seen.tube ? pairs : [])
      for (let t = 0; t < T; t++) {
        if (!active(pair, t)) continue;
        const gap = gapOf(seen, pair, t), mine = gaps[pair.obstacle];
        if (!(mine[t] <= gap)) mine[t] = gap;
        if (!worst || gap < clearance) { clearance = gap; worst = { pair, t }; }
      }
    const reaches = goal.least >= 0 && start >= 0;
    const sure = reaches && surely(seen, p0);
    const polytope = sure ? polytopeAround(seen) : -1, corridor = sure ? corridorAround(seen) : -1;
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
  const keeps = (sep, seen) =>
    data.directions[sep].every((runs, pair) => runs.every((run) => runMargin(run, pairs[pair], seen) > 0));

  // room [m] that a run of a certificate leaves between a pair
  function runMargin([first, end, w, support], { points }, seen) {
    let least = Infinity;
    for (let t = first; t < end; t++)
      for (const i of points) {
        const nearest = dot(w, farthest(seen.tube.errors[t][i], w, -1));
        for (const place of [seen.path[t][i], seen.path[t + 1][i]]) least = Math.min(least, dot(w, place) + nearest - support);
      }
    return least / Math.hypot(...w);
  }

  // 2: proved, or shown in float64 where the answer is: in a returned corridor or polytope; 1: safe for this page's arithmetic alone; 0: not shown safe
  function level(p0, k) {
    const seen = plan(p0, k);
    if (!(goalMargin(seen).least >= 0 && startMargin(p0) >= 0 && touchesNothing(seen))) return 0;
    return surely(seen, p0) && (corridorAround(seen) >= 0 || polytopeAround(seen) >= 0) ? 2 : 1;
  }

  function touchesNothing(seen) {
    for (const pair of pairs)
      for (let t = 0; t < T; t++)
        if (active(pair, t) && !farApart(seen, pair, t) && !(gapOf(seen, pair, t) > 0)) return false;
    return true;
  }

  // boxes around both that do not meet: most pairs, and cheap
  function farApart(seen, { points, radius, box }, t) {
    for (let axis = 0; axis < nP; axis++) {
      let lo = Infinity, hi = -Infinity;
      for (const i of points) {
        const a = seen.path[t][i][axis], b = seen.path[t + 1][i][axis], errors = seen.tube.boxes[t][i];
        lo = Math.min(lo, a + errors.lo[axis], b + errors.lo[axis]);
        hi = Math.max(hi, a + errors.hi[axis], b + errors.hi[axis]);
      }
      if (lo > box.hi[axis] + radius || hi < box.lo[axis] - radius) return true;
    }
    return false;
  }

  const single = data.parts.length === 1 && data.parts[0].points.length === 1; // a body that is one point, grown
  return { T, pairs, single, plan, verdict, level, ends, swept, runMargin, active };
}
