"use strict";
// An episode, moment by moment. The address after # holds the time: #t=seconds. Numbers count from 0.

const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const scene = new View($("scene"), true, [0, 0]), chain = new View($("chain"), false, [8, 8]);
const TUBE = "#d6e8f5", OBSTACLE = "#6e6e6e", FREE = "#f3f0dc", STANDS = "#d9d9d9";
const ROWS = 8; // of bars, so that manoeuvres that overlap are seen one above the other
const last = data.moments.length - 1, over = Math.max(...data.manoeuvres.map((one) => one.end));
const momentOf = (time) => { const found = data.moments.findIndex((moment) => moment.time > time - 1e-3); return found < 0 ? last : found; };
let t = 0;

// the last of them that began by now; each is [time, ...]
const latest = (list, time) => list.filter(([begin]) => begin <= time + 1e-9).at(-1);

function draw() {
  const { time, number, body, middle } = data.moments[t], one = data.manoeuvres[number], r = data.reach;
  if ($("follow").checked) scene.show(middle.map((v) => v - r), middle.map((v) => v + r)); else scene.show(data.lo, data.hi);
  scene.clear();
  for (const [outline, ...holes] of latest(data.seen, time)?.[1] || []) {
    scene.shape(outline, { fill: FREE });
    for (const hole of holes) scene.shape(hole, { fill: "#fff" });
  }
  for (const outline of data.standing) scene.shape(outline, { fill: STANDS });
  for (const outline of one.tube) scene.shape(outline, { fill: TUBE, stroke: TUBE });
  for (const outline of one.obstacles) scene.shape(outline, { fill: OBSTACLE, stroke: OBSTACLE, width: 1.5 });
  for (const outline of one.rest) scene.shape(outline, { stroke: INK.blue, width: 1.5 });
  scene.shape(data.moments.slice(0, t + 1).map((moment) => moment.middle), { stroke: INK.blue, width: 1.5, open: true });
  for (const outline of body) scene.shape(outline, { fill: INK.blue });
  drawChain(time);
  words(number, one, time);
}

// every manoeuvre as a bar: driven until the next one began, and what was in hand from there to its rest
function drawChain(time) {
  chain.show([data.begin, 0], [over, ROWS]);
  chain.clear();
  data.manoeuvres.forEach(({ begin, end }, number) => {
    const row = ROWS - 1 - (number % ROWS), left = data.manoeuvres[number + 1]?.begin ?? end;
    const bar = (from, to, fill) => chain.shape([[from, row + 0.1], [to, row + 0.1], [to, row + 0.9], [from, row + 0.9]], { fill });
    bar(begin, end, TUBE);
    bar(begin, Math.min(left, end), INK.blue);
  });
  for (const [when] of data.reasons) chain.shape([[when, 0], [when, ROWS]], { stroke: INK.red, open: true });
  chain.shape([[time, 0], [time, ROWS]], { stroke: INK.black, open: true });
}

function words(number, one, time) {
  const next = data.manoeuvres[number + 1], why = latest(data.reasons, time);
  const kept = why && why[0] > one.begin + 1e-9 ? why : null, waits = time >= one.end - 1e-9;
  const then = next ? `Left for manoeuvre ${number + 1} at ${spelled(next.begin)} s.` : "No other one follows in this file.";
  const title = kept || waits ? `${waits ? "At the end of" : "The stop in hand:"} manoeuvre ${number}` : `Manoeuvre ${number}`;
  const n = data.obstacles[number];
  $("verdict").className = kept ? "unsafe" : "proved";
  $("verdict").replaceChildren(Object.assign(document.createElement("b"), { textContent: title }),
    `Proved against ${n} obstacle${n === 1 ? "" : "s"}${data.spans[number] ? " (parts of what moves, each for its time alone, included: nothing is said of it later)" : ""}, for every run inside the tube. Begun at ${spelled(one.begin)} s; that it rests at its end, at ${spelled(one.end)} s, is assumed. ${then}${data.notes}`);
  $("why").textContent = kept ? `${spelled(kept[0])} s: no new one, since ${kept[1]}.` : "";
  $("clock").textContent = `${spelled(time)} of ${spelled(data.moments[last].time)} s`;
  $("manoeuvre").value = number;
  $("link").href = `#t=${spelled(time)}`;
  $("k").replaceChildren(...data.k.map((label, i) => {
    const row = document.createElement("tr"), cell = (kind, text) => Object.assign(document.createElement(kind), { textContent: text });
    row.append(cell("th", label), cell("td", one.k[i]));
    return row;
  }));
  Object.assign(document.body.dataset, { number, kept: kept ? kept[1] : "" });
}

const go = makePlayer($("play"), $("time"), last, data.step, (moment) => { t = moment; draw(); });
const select = (number) => go(momentOf(data.manoeuvres[Math.min(data.manoeuvres.length - 1, Math.max(0, number))].begin));
$("manoeuvre").max = data.manoeuvres.length - 1;
$("manoeuvre").onchange = () => select(Math.trunc(Number($("manoeuvre").value)) || 0);
$("previous").onclick = () => select(data.moments[t].number - 1);
$("next").onclick = () => select(data.moments[t].number + 1);
$("follow").onchange = draw;
window.onresize = draw;
window.onhashchange = readAddress;

function readAddress() {
  const wanted = Number(new URLSearchParams(location.hash.slice(1)).get("t"));
  go(Number.isFinite(wanted) ? momentOf(wanted) : t);
}

$("title").textContent = `${data.name}: an episode`;
document.body.classList.add(data.true ? "true" : "predicted");
document.body.classList.toggle("doubt", data.doubt);
$("statement").textContent = data.statement;
readAddress();
document.body.dataset.ready = "1";
