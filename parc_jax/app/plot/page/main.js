// State, input and words. The address after # holds the state: #p0=x,y&k=..&t=knot or #sample=3. Numbers count from 0.

const data = JSON.parse(document.getElementById("data").textContent);
const model = makeModel(data);
const $ = (id) => document.getElementById(id);
const scenes = data.views.map(({ name, axes }, number) => {
  const canvas = number ? document.createElement("canvas") : $("scene"), side = data.views.length > 1 ? `, seen ${name}` : "";
  canvas.setAttribute("aria-label", `Workspace${side}: drag the orange start, scroll to zoom, drag the ground to pan`);
  if (number) $("views").append(canvas);
  return Object.assign(new View(canvas, true, [24, 24]), { axes, number });
});
const plane = new View($("parameters"), false, [42, 20]);
const strip = new View($("clearance"), false, [34, 6]);
const state = { p0: [], k: [], t: 0, sample: -1, axes: [0, Math.min(1, data.n_k - 1)], clipped: [], cells: [], starts: [], fields: [], directions: -1, unread: false };
const CELLS = 36; // across K and across the goal, for what is safe here and now
const nameOf = (label) => label.replace(/ \[[^\]]*\]$/, "");
const origin = data.labels.p.map(() => 0); // a start from which paths are offsets
const endOf = (p0, k) => model.plan(p0, k).path[model.T][0]; // of the first reference point
const BY = data.level === "float-bounded" ? "shown in float64" : "proved"; // what the answer's certificates do
const seconds = (knot) => spelled(knot * data.dt);
const partsOf = (pair) => (data.parts.length > 1 ? ` with part ${pair.part}` : "");
// a bound for people, to three digits: never above the value
const atLeast = (x) => {
  const unit = x && Number.isFinite(x) ? 10 ** (Math.floor(Math.log10(Math.abs(x))) - 2) : 1;
  return Number((Math.floor(x / unit) * unit).toPrecision(3));
};
let painting = 0, frame = 0;

function select(number) {
  if (!data.samples.length) return;
  state.sample = ((number % data.samples.length) + data.samples.length) % data.samples.length;
  state.p0 = data.samples[state.sample].p0.slice();
  state.k = data.samples[state.sample].k.slice();
  Object.assign(state, { clipped: [], unread: false });
  update();
}

const clippedTo = (i, v, end) => ` ${nameOf(data.labels.k[i])} = ${v} is outside of ${data.box}, which ends there at ${end}: that is shown.`;

function move(p0, k) {
  const inside = k.map((v, i) => Math.min(data.domain.hi[i], Math.max(data.domain.lo[i], v)));
  if ($("anchor").checked && p0 === state.p0) {
    p0 = minus(endOf(state.p0, state.k), endOf(origin, inside));
  }
  Object.assign(state, { p0, k: inside, unread: false, clipped: k.flatMap((v, i) => (v === inside[i] ? [] : [clippedTo(i, v, inside[i])])) });
  update();
}

function update() {
  state.seen = model.verdict(state.p0, state.k);
  const own = state.sample >= 0 && data.samples[state.sample];
  const at = own && state.seen.tube && own.p0.every((v, i) => v === state.p0[i]) && own.k.every((v, i) => v === state.k[i]);
  state.within = at ? { kind: "sample", number: state.sample, sep: own.sep }
    : state.seen.polytope >= 0 ? { kind: "polytope", number: state.seen.polytope, sep: data.polytopes[state.seen.polytope].sep }
    : state.seen.corridor >= 0 ? { kind: "corridor", number: state.seen.corridor, sep: data.corridors[state.seen.corridor].sep }
    : null;
  state.directions = state.within ? state.within.sep : -1;
  words();
  draw();
  paintSafe();
}

function draw() {
  cancelAnimationFrame(frame);
  frame = requestAnimationFrame(() => {
    for (const scene of scenes) drawScene(scene, data, model, state);
    drawParameters(plane, data, state);
    drawClearance(strip, data, model, state);
  });
}

function words() {
  const { seen, within } = state, box = $("verdict");
  const kind = state.unread ? "unread" : within ? "proved" : seen.safe ? "safe" : "unsafe";
  const near = seen.worst; // an interval has no one moment: the tube is of all of it
  const room = near ? `Least clearance ${atLeast(seen.clearance)} m from obstacle ${near.pair.obstacle}${partsOf(near.pair)} between ${seconds(near.t)} and ${seconds(near.t + 1)} s.`
    : data.obstacles.length ? "No obstacle is there in that time." : "There is no obstacle.";
  const start = data.at ? `all plans of this answer start at (${data.at.join(", ")})` : "starts outside of the start set";
  const missed = seen.start < 0 ? start : model.ends(seen) ? "not all of the tube ends in the goal" : "misses the goal";
  const title = {
    proved: within && { sample: "Safe: sample ", polytope: "Safe: inside polytope ", corridor: "Safe: keeps to corridor " }[within.kind] + within.number,
    safe: "Safe for the model, but in no returned corridor or polytope by more than rounding",
    unsafe: `Not shown safe: ${!seen.bins.length ? `k lies outside of ${data.box}` : !seen.tube ? "no claim is about this k" : !seen.reaches ? missed : "touches"}`,
    unread: "This link is not of this answer",
  }[kind];
  const proof = `${BY}${BY === "proved" ? " in exact arithmetic" : ""} by the certificate in the answer file (parc-jax check verifies it)`;
  const lines = {
    proved: `For every run inside the tube, ${proof}. ${room}`,
    safe: `Computed by this page in double precision, not proved. ${room}`,
    unsafe: !seen.tube ? `There is no tube${seen.bins.length ? ` in this bin of ${data.box}` : ""}.` : `Goal margin ${atLeast(seen.goal.least)}. ${room}`,
    unread: "It names no plan of this answer. What is drawn is another plan.",
  }[kind];
  box.className = kind;
  box.replaceChildren(Object.assign(document.createElement("b"), { textContent: title }), lines, ...state.clipped);
  Object.assign(box.dataset, { kind, clearance: seen.clearance, goal: seen.goal.least, polytope: seen.polytope, corridor: seen.corridor });
  if (data.samples.length) $("sample").value = state.sample;
  $("time").value = state.t;
  $("clock").textContent = `${seconds(state.t)} of ${seconds(model.T)} s`;
  $("fixed").textContent = $("anchor").checked ? "end held" : "start held";
  starts.forEach((field, i) => { show(field, state.p0[i]); });
  state.k.forEach((v, i) => { sliders[i].slider.value = v; show(sliders[i].field, v); });
  $("link").href = `#p0=${state.p0.join()}&k=${state.k.join()}&t=${state.t}`;
  certificate();
}

function certificate() {
  const { within } = state, out = $("certificate");
  if (!within) { out.textContent = "None: this plan is no sample and lies in no returned corridor or polytope by more than rounding."; return; }
  const several = data.parts.length > 1;
  const rows = data.directions[within.sep].flatMap((runs, number) => runs.map((run) => {
    const pair = model.pairs[number], [first, end, w] = run, size = Math.hypot(...w), now = state.t >= first && state.t < end;
    return `<tr class="${now ? "now" : ""}"><td>${pair.obstacle}</td>${several ? `<td>${pair.part}</td>` : ""}<td>${seconds(first)} to ${seconds(end)}</td>`
      + `<td>(${w.map((v) => Number((v / size).toPrecision(3))).join(", ")})</td><td>${atLeast(model.runMargin(run, pair, state.seen))}</td></tr>`;
  }));
  out.innerHTML = `<p>Of ${within.kind} ${within.number}: p0 = (${state.p0.join(", ")}), k = (${state.k.join(", ")}). While one direction w holds, the tube stays on`
    + ` the far side of the dotted line.</p><table><tr><th>obstacle</th>${several ? "<th>part</th>" : ""}<th>time [s]</th>`
    + "<th>direction w</th><th>room [m]</th></tr>"
    + `${rows.join("")}</table><p>Goal margin ${atLeast(state.seen.goal.least)}.</p>`
    + "<p><code></code></p>";
  const [problem, network] = [data.hash.problem, data.hash.network].map((h) => String(h).slice(0, 16));
  out.querySelector("code").textContent = `problem ${problem}… network ${network}…`;
}

// what is safe with the start (or the end) held, and from where this k is safe: cell by cell, without blocking input
function paintSafe() {
  const run = ++painting, [i, j] = state.axes, { lo, hi } = data.domain, anchored = $("anchor").checked;
  const end = endOf(state.p0, state.k), offset = endOf(origin, state.k);
  const ofK = (x, y) => {
    const k = state.k.slice();
    k[i] = x; k[j] = y;
    return model.level(anchored ? minus(end, endOf(origin, k)) : state.p0, k);
  };
  const [goalLo, goalHi] = [minus(data.goal_box.lo, offset), minus(data.goal_box.hi, offset)];
  const besides = (x, ...axes) => x.filter((_, axis) => !axes.includes(axis));
  const wanted = scenes.map(({ axes: [a, b] }) => [[state.k, besides(state.p0, a, b)], () => grid([goalLo[a], goalLo[b]], [goalHi[a], goalHi[b]],
    (x, y) => model.level(state.p0.map((v, axis) => (axis === a ? x : axis === b ? y : v)), state.k))]);
  // an end that is held still moves by rounding: less than a nanometre is the same end
  const held = anchored ? end.map((v) => v.toFixed(9)) : state.p0;
  if (data.n_k > 1) wanted.push([[anchored, held, i, j, besides(state.k, i, j)], () => grid([lo[i], lo[j]], [hi[i], hi[j]], ofK)]);
  // cells say of what they are: of another k, or start, none is drawn while its own are computed
  const fields = state.fields = wanted.map(([of, make], n) => {
    const old = state.fields[n], own = JSON.stringify(of);
    return old?.of === own ? old : Object.assign(make(), { of: own });
  });
  const showDone = () => {
    const done = fields.map((field) => (field.done() ? field.cells : []));
    Object.assign(state, { starts: done.slice(0, scenes.length), cells: done[scenes.length] || [] });
  };
  showDone();
  const work = () => {
    if (run !== painting) return;
    for (const until = performance.now() + 12; performance.now() < until;) if (fields.every((field) => field.step())) break;
    if (!fields.every((field) => field.done())) { setTimeout(work, 0); return; }
    showDone();
    const proved = state.cells.filter((cell) => cell.level === 2).length;
    Object.assign(document.body.dataset, { starts: state.starts[0].length, cells: state.cells.length, proved });
    draw();
  };
  setTimeout(work, 60);
}

// cells of a grid whose middle is safe, with the level of the proof, computed row by row
function grid(lo, hi, levelAt) {
  const size = [(hi[0] - lo[0]) / CELLS, (hi[1] - lo[1]) / CELLS], cells = [];
  let row = 0;
  const step = () => {
    if (row >= CELLS) return true;
    const y = lo[1] + row++ * size[1];
    for (let column = 0; column < CELLS; column++) {
      const x = lo[0] + column * size[0];
      const level = levelAt(x + size[0] / 2, y + size[1] / 2);
      if (level) cells.push({ corners: [[x, y], [x + size[0], y], [x + size[0], y + size[1]], [x, y + size[1]]], level });
    }
    return row >= CELLS;
  };
  return { cells, step, done: () => row >= CELLS };
}

function frameScene() {
  for (const scene of scenes) {
    const of = (place) => scene.axes.map((a) => place[a]), goals = data.goals.flatMap((goal) => goal.outlines[scene.number]);
    const points = [...goals, ...data.samples.map((s) => of(s.p0)), of(state.p0), ...model.plan(state.p0, state.k).path.flat().map(of)];
    for (const { corners, radius } of model.pairs) points.push(...swell(corners.map(of), radius));
    const { lo, hi } = around(points);
    scene.show(lo, hi);
  }
  const [i, j] = state.axes, { lo, hi } = data.domain;
  plane.show([lo[i], lo[j]], i === j ? [hi[i], lo[j] + 1] : [hi[i], hi[j]]);
}

// a field to type a number into; `set` gets it, and what is no number is put back
function numberField(label, set) {
  const field = document.createElement("input");
  Object.assign(field, { type: "number", step: "any" });
  field.setAttribute("aria-label", label);
  field.onchange = () => { if (field.value !== "" && Number.isFinite(Number(field.value))) set(Number(field.value)); else update(); };
  return field;
}

// never under the fingers of somebody who types; exact, so that what is shown is what is judged
function show(field, value) { if (document.activeElement !== field || Number(field.value) !== value) field.value = value; }

const labelled = (text, ...parts) => {
  const label = document.createElement("label"), name = document.createElement("span");
  name.textContent = text;
  label.append(name, ...parts);
  return label;
};

const starts = data.labels.p.map((name, i) => {
  const field = numberField(`start ${name}`, (v) => move(state.p0.map((old, n) => (n === i ? v : old)), state.k));
  $("starts").append(labelled(`start ${name}`, field));
  return field;
});

const sliders = data.domain.lo.map((lo, i) => {
  const slider = document.createElement("input"), name = data.labels.k[i];
  Object.assign(slider, { type: "range", min: lo, max: data.domain.hi[i], step: "any" });
  slider.setAttribute("aria-label", name);
  const set = (v) => move(state.p0, state.k.map((old, n) => (n === i ? v : old)));
  slider.oninput = () => set(Number(slider.value));
  const field = numberField(name, set);
  $("sliders").append(labelled(name, slider, field));
  return { slider, field };
});

function dragging(view, grab) {
  let held = null;
  const at = (event) => { const r = view.canvas.getBoundingClientRect(); return [event.clientX - r.left, event.clientY - r.top]; };
  view.canvas.onpointerdown = (event) => { held = grab(...at(event)); view.canvas.setPointerCapture?.(event.pointerId); };
  view.canvas.onpointermove = (event) => { if (held) held(...at(event)); };
  view.canvas.onpointerup = view.canvas.onpointercancel = () => { held = null; };
}

for (const scene of scenes) {
  const of = (place) => scene.axes.map((a) => place[a]);
  const to = (x, y) => { const at = scene.at(x, y); return state.p0.map((v, a) => at[scene.axes.indexOf(a)] ?? v); };
  dragging(scene, (x, y) => {
    const away = (place) => { const [u, v] = scene.px(of(place)); return Math.hypot(u - x, v - y); };
    if (away(state.p0) < 14) return (u, v) => move(to(u, v), state.k);
    const near = data.samples.findIndex((s) => away(s.p0) < 6);
    if (near >= 0) { select(near); return null; }
    let [fromX, fromY] = [x, y];
    return (u, v) => {
      scene.middle[0] -= (u - fromX) / scene.scale[0]; scene.middle[1] += (v - fromY) / scene.scale[1];
      [fromX, fromY] = [u, v];
      draw();
    };
  });
  scene.canvas.onwheel = (event) => {
    event.preventDefault();
    const r = scene.canvas.getBoundingClientRect(), x = event.clientX - r.left, y = event.clientY - r.top, before = scene.at(x, y);
    const zoom = Math.exp(-event.deltaY / 400);
    scene.scale = scene.scale.map((s) => s * zoom);
    const after = scene.at(x, y);
    scene.middle = scene.middle.map((m, a) => m + before[a] - after[a]);
    draw();
  };
  scene.canvas.ondblclick = () => { frameScene(); draw(); };
}

dragging(plane, (x, y) => {
  const go = (u, v) => {
    const [a, b] = plane.at(u, v), k = state.k.slice();
    k[state.axes[0]] = a;
    if (state.axes[0] !== state.axes[1]) k[state.axes[1]] = b;
    move(state.p0, k);
  };
  go(x, y);
  return go;
});

if (data.n_k > 2)
  for (const side of [0, 1]) {
    const choice = document.createElement("select");
    data.domain.lo.forEach((_, i) => choice.add(new Option(nameOf(data.labels.k[i]), i, false, i === state.axes[side])));
    choice.onchange = () => {
      const other = state.axes[1 - side], wanted = Number(choice.value);
      if (wanted === other) { choice.value = state.axes[side]; return; }
      state.axes[side] = wanted;
      state.axes.sort((a, b) => a - b);
      $("axes").querySelectorAll("select").forEach((s, n) => { s.value = state.axes[n]; });
      frameScene(); update();
    };
    $("axes").append(choice);
  }

makePlayer($("play"), $("time"), model.T, data.dt, (t) => { state.t = t; words(); draw(); });
$("sample").max = data.samples.length - 1;
$("sample").onchange = () => select(Math.round(Number($("sample").value)));
$("previous").onclick = () => select(state.sample - 1);
$("next").onclick = () => select(state.sample + 1);
$("reset").onclick = () => select(Math.max(0, state.sample));
$("anchor").onchange = update;
window.onresize = () => { for (const view of [...scenes, plane]) view.fit(); draw(); };
window.onhashchange = readAddress;

function readAddress() {
  const wanted = new URLSearchParams(location.hash.slice(1)), names = [...wanted.keys()];
  if (!names.length) return;
  const known = { p0: data.n_p, k: data.n_k, t: 1, sample: 1 }, told = {};
  // nothing of a link counts unless all of it can be read: a number that is left out is no 0, half a plan is another plan, and of two that are named neither is meant
  const read = new Set(names).size === names.length && names.every((name) => {
    told[name] = wanted.get(name).split(",").map((text) => (text.trim() ? Number(text) : NaN));
    return told[name].length === known[name] && told[name].every(Number.isFinite);
  });
  const upTo = ([number], last) => Number.isInteger(number) && number >= 0 && number <= last;
  const { p0, k, t = [state.t], sample } = told;
  if (!read || !upTo(t, model.T) || !(sample ? !p0 && !k && upTo(sample, data.samples.length - 1) : !p0 === !k)) { state.unread = true; words(); return; }
  Object.assign(state, { t: t[0], unread: false });
  if (sample) select(sample[0]);
  else if (p0) move(p0, k);
  else update();
}

$("title").textContent = `${data.system || "Answer"}: safe manoeuvres`;
const holding = (n, word, share) => `${n} ${word}${n === 1 ? "" : "s"}${share > 0 ? ` (at least ${(Math.floor(1000 * share) / 10).toFixed(1)} % of ${data.set}, confidence ${data.sure[word]})` : ""}`;
$("summary").textContent = `${holding(data.samples.length, "sample")}, ${holding(data.corridors.length, "corridor", data.corridor_share)}, `
  + `${holding(data.polytopes.length, "polytope", data.share)}; ${data.level}; the tube: ${data.claim}.`;
$("statement").textContent = data.statement;
for (const word of document.querySelectorAll(".by")) word.textContent = BY;
state.k = data.domain.lo.map((lo, i) => (lo + data.domain.hi[i]) / 2);
state.p0 = data.at?.slice() || plus(data.goal_box.lo, data.goal_box.hi).map((v) => v / 2);
$("anchor").disabled = Boolean(data.at); // it moves the start
$("about").textContent = data.about.join(" ");
document.body.classList.toggle("doubt", data.doubt);
if (data.samples.length) Object.assign(state, { sample: 0, p0: data.samples[0].p0.slice(), k: data.samples[0].k.slice() });
document.body.classList.add(model.single ? "single" : "hull", data.n_p === 2 ? "plane" : "space");
update();
readAddress();
frameScene();
document.body.dataset.ready = "1";
