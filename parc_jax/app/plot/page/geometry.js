"use strict";
// Convex sets given by points (arrays of 2 or 3 numbers), in double precision.

const dot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
const plus = (a, b) => a.map((v, i) => v + b[i]);
const minus = (a, b) => a.map((v, i) => v - b[i]);

// all sums of a point of one set and a point of the other
const sums = (some, others) => some.flatMap((a) => others.map((b) => plus(a, b)));

// smallest box around points: { lo, hi }
function around(points) {
  const ends = (pick) => points.reduce((far, p) => far.map((v, a) => pick(v, p[a])));
  return { lo: ends(Math.min), hi: ends(Math.max) };
}

// corners of the box of errors |e| <= half
const boxCorners = (half) => half.reduce((corners, h) => corners.flatMap((c) => [[...c, -h], [...c, h]]), [[]]);

// corners of the errors between pairs of faces |u . e - c| <= s: where as many faces meet as there are dimensions
function faceCorners(directions, centre, half) {
  const inside = (e) => directions.every((u, j) => Math.abs(dot(u, e) - centre[j]) <= half[j] * (1 + 1e-9) + 1e-12);
  return choices(directions.length, directions[0].length).flatMap((chosen) =>
    boxCorners(chosen.map((j) => half[j]))
      .map((ends) => solved(chosen.map((j) => directions[j]), chosen.map((j, i) => centre[j] + ends[i])))
      .filter((corner) => corner && inside(corner)));
}

// all ways to choose some of n numbers, from 0
function choices(n, some) {
  if (some === 0) return [[]];
  return Array.from({ length: n }, (_, last) => choices(last, some - 1).map((others) => [...others, last])).flat();
}

// convex hull in the plane, counter-clockwise, without points on its edges
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

// the hull of points in the plane swelled by a disc, as a dense outline
function swell(points, radius) {
  const ring = Array.from({ length: radius > 0 ? 40 : 1 }, (_, i) => (i * 2 * Math.PI) / 40);
  return hull(sums(points, ring.map((angle) => [radius * Math.cos(angle), radius * Math.sin(angle)])));
}

// gap and unit direction w from one set to another, in the plane of their hulls: the best direction found. A positive gap is their distance;
// in the plane the gap of sets that meet is the way to push them apart, negative.
function separation(body, obstacle) {
  const best = { gap: -Infinity, w: null };
  const look = (direction) => {
    const size = Math.hypot(...direction);
    if (!(size > 0)) return null;
    const w = direction.map((v) => v / size);
    const near = farthest(body, w, -1), far = farthest(obstacle, w, 1);
    const gap = dot(w, near) - dot(w, far);
    if (gap > best.gap) Object.assign(best, { gap, w });
    return minus(near, far);
  };
  if (body[0].length === 2) lookInPlane(body, obstacle, look); else lookInSpace(body, obstacle, look);
  return best;
}

function farthest(points, w, sign) {
  let found = points[0], most = -Infinity;
  for (const p of points) {
    const reach = sign * dot(w, p);
    if (reach > most) { most = reach; found = p; }
  }
  return found;
}

// every direction that can be best in the plane: normals of the edges of both hulls, and between nearest corners
function lookInPlane(body, obstacle, look) {
  for (const corners of [body, obstacle])
    corners.forEach((a, i) => {
      const [dx, dy] = minus(corners[(i + 1) % corners.length], a);
      look([dy, -dx]);
      look([-dy, dx]);
    });
  let nearest = minus(body[0], obstacle[0]);
  for (const a of body) for (const b of obstacle) {
    const apart = minus(a, b);
    if (dot(apart, apart) < dot(nearest, nearest)) nearest = apart;
  }
  look(nearest);
}

const STEPS = 64; // of the search in space: it ends long before
// Gilbert, Johnson and Keerthi's search for the point of body - obstacle that is nearest to the origin
function lookInSpace(body, obstacle, look) {
  body[0].forEach((_, axis) => { for (const sign of [-1, 1]) look(body[0].map((_, a) => (a === axis ? sign : 0))); });
  let v = minus(body[0], obstacle[0]), simplex = [];
  for (let step = 0; step < STEPS && simplex.length <= body[0].length; step++) {
    const seen = look(v);
    if (!seen || dot(v, v) - dot(v, seen) <= 1e-12 * dot(v, v)) return;
    ({ point: v, simplex } = nearestOf([...simplex, seen]));
  }
}

// the point of the hull of a few points that is nearest to the origin, and those of them that hold it
function nearestOf(points) {
  let best = null;
  for (let chosen = 1; chosen < 2 ** points.length; chosen++) {
    const simplex = points.filter((_, i) => (chosen >> i) & 1), shares = footOf(simplex);
    if (!shares || shares.some((share) => share < 0)) continue;
    const point = simplex.map((p, i) => p.map((v) => shares[i] * v)).reduce(plus);
    if (!best || dot(point, point) < dot(best.point, best.point)) best = { point, simplex };
  }
  return best;
}

// shares with which affinely independent points give the point of their plane nearest to the origin, else null
function footOf([first, ...others]) {
  const sides = others.map((p) => minus(p, first));
  const inner = solved(sides.map((a) => sides.map((b) => dot(a, b))), sides.map((a) => -dot(a, first)));
  return inner && [1 - inner.reduce((sum, share) => sum + share, 0), ...inner];
}

// x with A x = b by elimination, null where A is singular
function solved(A, b) {
  const rows = A.map((row, i) => [...row, b[i]]), n = b.length, size = Math.max(...A.flat().map(Math.abs));
  for (let column = 0; column < n; column++) {
    const pivot = rows.slice(column).reduce((top, row) => (Math.abs(row[column]) > Math.abs(top[column]) ? row : top));
    if (!(Math.abs(pivot[column]) > 1e-14 * size)) return null;
    rows[rows.indexOf(pivot)] = rows[column];
    rows[column] = pivot;
    for (let i = 0; i < n; i++) {
      if (i === column) continue;
      const factor = rows[i][column] / pivot[column];
      rows[i] = rows[i].map((v, j) => v - factor * pivot[j]);
    }
  }
  return rows.map((row, i) => row[n] / row[i]);
}
