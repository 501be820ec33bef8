// node js/run.js proved.js answer.json ...: for each file the verdict as `check --each` prints it, and ms per entry on stderr
const fs = require("fs");
const [program, ...answers] = process.argv.slice(2);
require(require("path").resolve(program));
for (const path of answers) {
  const start = process.hrtime.bigint();
  const verdict = globalThis.parcCheck(fs.readFileSync(path));
  const ms = Number(process.hrtime.bigint() - start) / 1e6;
  const entries = Object.values(verdict.entries).join("").length;
  console.log(JSON.stringify(verdict));
  console.error(`${path}: ${entries} entries, ${ms.toFixed(0)} ms, ${(ms / Math.max(1, entries)).toFixed(2)} ms each`);
}
