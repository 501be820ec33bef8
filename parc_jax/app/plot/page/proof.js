// The proved checker, asked about the whole answer: in a worker, so that the page stays alive, and without network.

const PYTHON = {
  "exact-proved": "accepted all of it, before this page was written",
  "no-plan": `accepted the proof of this, before this page was written: ${data.absence}`,
  "float-bounded": "was not asked: this answer is shown in float64 only",
}[data.level] || "was not asked: this answer claims nothing";
const KIND = { samples: "samples", sets: "polytopes", corridors: "corridors", doubt: "boxes of doubt" };
const MEGABYTES = Number($("answer").dataset.bytes) / 1e6;
const WORKER = `
;onmessage = ({ data: text }) => {
  const start = performance.now();
  let entries = 0, told = start;
  const verdict = parcCheck(text, (kind, done, total) => {
    entries++;
    if (performance.now() - told < 100 && done < total) return;
    told = performance.now();
    postMessage({ kind, done, total, entries });
  });
  postMessage({ verdict, entries, ms: performance.now() - start });
};`;
let worker = null, program = "";

function sayProved(kind, words, lines = []) {
  $("second").className = kind;
  $("second").textContent = words;
  $("said").textContent = lines.join("\n");
}

function stopProved() {
  worker.terminate();
  worker = null;
  URL.revokeObjectURL(program);
  $("prove").textContent = "check with the proved checker";
  $("progress").hidden = true;
}

// Only code 0 about this very problem, network and tube is an acceptance.
function judge({ verdict, entries, ms }) {
  const { code, lines } = verdict, time = `${entries} entries in ${(ms / 1000).toFixed(1)} s`;
  const own = Object.keys(data.hash).every((part) => lines.some((line) => line.trim() === `sha256 ${part} ${data.hash[part]}`));
  if (code === 1) sayProved("unsafe", `rejected (${time})`, lines);
  else if (!own) sayProved("unsafe", "no verdict: what it read is not what this page shows");
  else if (code === 0) sayProved("proved", `accepted all of it (${time})`, lines);
  else if (code === 3) sayProved("safe", `accepted what it looked at, not all (${time})`, lines);
  else sayProved("unsafe", "no verdict: an answer of the checker that this page does not know");
  Object.assign($("second").dataset, { code, entries, ms: ms.toFixed(0) });
}

$("prove").onclick = () => {
  if (worker) { stopProved(); sayProved("", "stopped, no verdict"); return; }
  program = URL.createObjectURL(new Blob([$("proved").textContent, WORKER], { type: "text/javascript" }));
  const failed = (why) => { stopProved(); sayProved("unsafe", `no verdict: it could not run in this browser (${why})`); };
  delete $("second").dataset.code;
  sayProved("", "reads the answer");
  Object.assign($("progress"), { hidden: false, value: 0 });
  $("progress").max = data.samples.length + data.polytopes.length + data.corridors.length;
  worker = new Worker(program);
  $("prove").textContent = "stop";
  worker.onerror = (event) => failed(event.message);
  worker.onmessage = ({ data: news }) => {
    if (news.verdict) { stopProved(); judge(news); return; }
    $("progress").value = news.entries;
    sayProved("", `checks ${KIND[news.kind] || news.kind}: ${news.done} of ${news.total}`);
  };
  worker.postMessage($("answer").textContent);
};

$("first").textContent = PYTHON;
sayProved("", "not asked yet");
if (!$("answer").textContent) {
  $("prove").disabled = true;
  sayProved("", `not here: the answer has ${MEGABYTES.toFixed(0)} MB, too much for a page; parc-jax check answer.json --second asks it`);
}
