// State, input and words. The address after # holds the state: #p0=x,y&k=..&t=knot or #sample=3. Numbers count from 0.

const data = JSON.parse(document.getElementById("data").textContent);
const model = makeModel(data);
const $ = (id) => document.getElementById(id);
const scene = new View($("scene"), true, [24, 24]), plane = new View($("parameters"), false, [42, 20]);
const strip = new View($("clearance"), false, [34, 6]);
const state = { p0: [0, 0], k: [], t: 0, sample: -1, axes: [0, Math.min(1, data.n_k - 1)], cells: [], starts: [], directions: -1 };
const CELLS = 36; // across K and across the goal, for what is safe here and now
const nameOf = (label) => label.replace(/ \[[^\]]*\]$/, "");
const few = (values, digits = 4) => values.map((v) => Number(v.toPrecision(digits))).join(", ");
let painting = 0, frame = 0;

function select(number) {
  if (!data.samples.length) return;
  state.sample = ((number % data.samples.length) + data.samples.length) % data.samples.length;
  state.p0 = data.samples[state.sample].p0.slice();
  state.k = data.samples[state.sample].k.slice();
  update();
}

function move(p0, k) {
  const inside = k.map((v, i) => Math.min(data.domain.hi[i], Math.max(data.domain.lo[i], v)));
  if ($("anchor").checked && p0 === state.p0) {
    const end = model.plan(state.p0, state.k).path[model.T], offset = model.plan([0, 0], inside).path[model.T];
    p0 = [end[0] - offset[0], end[1] - offset[1]];
  }
  Object.assign(state, { p0, k: inside });
  update();
}

function update() {
  state.seen = model.verdict(state.p0, state.k);
  const own = state.sample >= 0 && data.samples[state.sample];
  const at = own && own.p0.every((v, i) => v === state.p0[i]) && own.k.every((v, i) => v === state.k[i]);
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
    drawScene(scene, data, model, state);
    drawParameters(plane, data, state);
    drawClearance(strip, data, model, state);
  });
}

function words() {
  const { seen, within } = state, box = $("verdict");
  const kind = within ? "proved" : seen.safe ? "safe" : "unsafe";
  const where = seen.worst ? `obstacle ${seen.worst[0]} at ${(seen.worst[1] * data.dt).toFixed(2)} s` : "no obstacle";
  const room = Number.isFinite(seen.clearance) ? `${seen.clearance.toPrecision(3)} m from ${where}` : where;
  const title = {
    proved: within && { sample: "Safe: sample ", polytope: "Safe: inside polytope ", corridor: "Safe: keeps to corridor " }[within.kind] + within.number,
    safe: "Safe for the model, but in no returned corridor or polytope",
    unsafe: !seen.widths ? "Not shown safe: k lies outside K" : !seen.reaches ? "Not shown safe: misses the goal" : "Not shown safe: touches",
  }[kind];
  const level = data.level === "exact-proved" ? "proved in exact arithmetic" : "shown in float64";
  const proof = `${level} by the certificate in the answer file (parc-jax check verifies it)`;
  const lines = {
    proved: `For every run inside the tube, ${proof}. Least clearance ${room}.`,
    safe: `Computed by this page in double precision, not proved. Least clearance ${room}.`,
    unsafe: !seen.widths ? "There is no tube." : `Goal margin ${seen.goal.least.toPrecision(3)}; least clearance ${room}.`,
  }[kind];
  box.className = kind;
  box.replaceChildren(Object.assign(document.createElement("b"), { textContent: title }), lines);
  Object.assign(box.dataset, { kind, clearance: seen.clearance, goal: seen.goal.least, polytope: seen.polytope, corridor: seen.corridor });
  if (data.samples.length) $("sample").value = state.sample;
  $("time").value = state.t;
  $("clock").textContent = `${(state.t * data.dt).toFixed(2)} of ${(model.T * data.dt).toFixed(2)} s`;
  $("fixed").textContent = $("anchor").checked ? "end held" : "start held";
  starts.forEach((field, i) => { show(field, state.p0[i]); });
  state.k.forEach((v, i) => { sliders[i].slider.value = v; show(sliders[i].field, v); });
  $("link").href = `#p0=${state.p0.join()}&k=${state.k.join()}&t=${state.t}`;
  certificate();
}

function certificate() {
  const { within } = state, out = $("certificate");
  if (!within) { out.textContent = "None: this plan is no sample and lies in no returned corridor or polytope."; return; }
  const rows = data.directions[within.sep].flatMap((runs, o) => runs.map((run) => {
    const [first, end, wx, wy] = run, size = Math.hypot(wx, wy), now = state.t >= first && state.t < end;
    const span = `${(first * data.dt).toFixed(2)} to ${(end * data.dt).toFixed(2)}`;
    return `<tr class="${now ? "now" : ""}"><td>${o}</td><td>${span}</td><td>(${few([wx / size, wy / size], 3)})</td>`
      + `<td>${model.runMargin(run, state.seen).toPrecision(3)}</td></tr>`;
  }));
  out.innerHTML = `<p>Of ${within.kind} ${within.number}: p0 = (${few(state.p0)}), k = (${few(state.k)}). While one direction w holds, the tube stays on`
    + " the far side of the dotted line.</p><table><tr><th>obstacle</th><th>time [s]</th><th>direction w</th><th>room [m]</th></tr>"
    + `${rows.join("")}</table><p>Goal margin ${state.seen.goal.least.toPrecision(3)}.</p>`
    + "<p><code></code></p>";
  const [problem, network] = [data.hash.problem, data.hash.network].map((h) => String(h).slice(0, 16));
  out.querySelector("code").textContent = `problem ${problem}… network ${network}…`;
}

// what is safe with the start (or the end) held, and from where this k is safe: cell by cell, without blocking input
function paintSafe() {
  const run = ++painting, [i, j] = state.axes, { lo, hi } = data.domain, anchored = $("anchor").checked;
  const end = model.plan(state.p0, state.k).path[model.T], offset = model.plan([0, 0], state.k).path[model.T];
  const ofK = (x, y) => {
    const k = state.k.slice();
    k[i] = x; k[j] = y;
    const c = anchored ? model.plan([0, 0], k).path[model.T] : null;
    return model.level(c ? [end[0] - c[0], end[1] - c[1]] : state.p0, k);
  };
  const goal = [0, 1].map((a) => data.goal_outline.map((p) => p[a] - offset[a]));
  const fields = [grid([Math.min(...goal[0]), Math.min(...goal[1])], [Math.max(...goal[0]), Math.max(...goal[1])],
    (x, y) => model.level([x, y], state.k))];
  if (data.n_k > 1) fields.push(grid([lo[i], lo[j]], [hi[i], hi[j]], ofK));
  const work = () => {
    if (run !== painting) return;
    for (const until = performance.now() + 12; performance.now() < until;) if (fields.every((field) => field.step())) break;
    if (!fields.every((field) => field.done())) { setTimeout(work, 0); return; }
    [state.starts, state.cells] = [fields[0].cells, fields[1]?.cells || []];
    const proved = state.cells.filter((cell) => cell.level === 2).length;
    Object.assign(document.body.dataset, { starts: state.starts.length, cells: state.cells.length, proved });
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
  const points = [...data.goal_outline, ...data.samples.map((s) => s.p0), state.p0, ...model.plan(state.p0, state.k).path];
  for (const o of data.obstacles) points.push(...swell(o.corner, data.radius));
  scene.show([0, 1].map((a) => Math.min(...points.map((p) => p[a]))), [0, 1].map((a) => Math.max(...points.map((p) => p[a]))));
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

dragging(scene, (x, y) => {
  const away = (p) => { const [u, v] = scene.px(p); return Math.hypot(u - x, v - y); };
  if (away(state.p0) < 14) return (u, v) => move(scene.at(u, v), state.k);
  const near = data.samples.findIndex((s) => away(s.p0) < 6);
  if (near >= 0) { select(near); return null; }
  let [fromX, fromY] = [x, y];
  return (u, v) => {
    scene.middle[0] -= (u - fromX) / scene.scale[0]; scene.middle[1] += (v - fromY) / scene.scale[1];
    [fromX, fromY] = [u, v];
    draw();
  };
});

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
      state.cells = []; frameScene(); update();
    };
    $("axes").append(choice);
  }

let playing = 0;
$("play").onclick = () => {
  clearInterval(playing);
  if ($("play").textContent === "▶") {
    if (state.t >= model.T) state.t = 0;
    playing = setInterval(() => { if (state.t >= model.T) $("play").click(); else { state.t++; words(); draw(); } }, 1000 * data.dt);
  }
  $("play").textContent = $("play").textContent === "▶" ? "❚❚" : "▶";
};
$("time").max = model.T;
$("time").oninput = () => { state.t = Number($("time").value); words(); draw(); };
$("sample").max = data.samples.length - 1;
$("sample").onchange = () => select(Number($("sample").value));
$("previous").onclick = () => select(state.sample - 1);
$("next").onclick = () => select(state.sample + 1);
$("reset").onclick = () => select(Math.max(0, state.sample));
$("anchor").onchange = update;
window.onresize = () => { for (const view of [scene, plane]) view.fit(); draw(); };
window.onhashchange = readAddress;

function readAddress() {
  const wanted = new URLSearchParams(location.hash.slice(1)), numbers = (name) => wanted.get(name)?.split(",").map(Number);
  if (wanted.has("t")) state.t = Math.min(model.T, Math.max(0, Number(wanted.get("t")) || 0));
  if (wanted.has("sample")) select(Math.trunc(Number(wanted.get("sample"))) || 0);
  const p0 = numbers("p0") || state.p0, k = numbers("k") || state.k;
  if ([...p0, ...k].every(Number.isFinite) && p0.length === 2 && k.length === data.n_k) move(p0, k);
}

$("title").textContent = `${data.system || "Answer"}: safe manoeuvres`;
const holding = (n, word, share) => `${n} ${word}${n === 1 ? "" : "s"}${share > 0 ? ` (${(100 * share).toFixed(1)} % of the model's safe set)` : ""}`;
$("summary").textContent = `${holding(data.samples.length, "sample")}, ${holding(data.corridors.length, "corridor", data.corridor_share)}, `
  + `${holding(data.polytopes.length, "polytope", data.share)}; ${data.level}; claim about the tube: ${data.claim}.`;
$("statement").textContent = data.statement;
state.k = data.domain.lo.map((lo, i) => (lo + data.domain.hi[i]) / 2);
state.p0 = data.goal_outline.reduce((a, p) => [a[0] + p[0] / data.goal_outline.length, a[1] + p[1] / data.goal_outline.length], [0, 0]);
if (data.samples.length) Object.assign(state, { sample: 0, p0: data.samples[0].p0.slice(), k: data.samples[0].k.slice() });
frameScene();
update();
readAddress();
document.body.dataset.ready = "1";
