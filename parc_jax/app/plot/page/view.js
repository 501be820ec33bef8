// Drawing. A View maps data to the pixels of one canvas.

const INK = { blue: "#0072b2", orange: "#e69f00", green: "#009e73", red: "#d55e00", grey: "#8c8c8c", black: "#222" };

const LINES = [INK.blue, INK.red, INK.green, INK.black, INK.orange, INK.grey];
const lineOf = (o) => LINES[o % LINES.length];

class View {
  constructor(canvas, equal, pad) {
    this.canvas = canvas; this.equal = equal; this.pen = canvas.getContext("2d");
    this.lo = [0, 0]; this.hi = [1, 1]; this.pad = pad; // [pixels] left and right, above and below
  }
  show(lo, hi) { this.lo = lo.slice(); this.hi = hi.slice(); this.fit(); }
  fit() {
    const ratio = window.devicePixelRatio || 1, { clientWidth: w, clientHeight: h } = this.canvas;
    this.canvas.width = w * ratio; this.canvas.height = h * ratio;
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.w = w; this.h = h;
    let sx = (w - 2 * this.pad[0]) / (this.hi[0] - this.lo[0]), sy = (h - 2 * this.pad[1]) / (this.hi[1] - this.lo[1]);
    if (this.equal) sx = sy = Math.min(sx, sy);
    this.scale = [sx, sy];
    this.middle = [(this.lo[0] + this.hi[0]) / 2, (this.lo[1] + this.hi[1]) / 2];
  }
  px(p) { return [this.w / 2 + (p[0] - this.middle[0]) * this.scale[0], this.h / 2 - (p[1] - this.middle[1]) * this.scale[1]]; }
  at(x, y) { return [this.middle[0] + (x - this.w / 2) / this.scale[0], this.middle[1] - (y - this.h / 2) / this.scale[1]]; }
  clear() { this.pen.clearRect(0, 0, this.w, this.h); }
  shape(points, { fill, stroke, width = 1, dash = [], open = false } = {}) {
    const pen = this.pen;
    pen.beginPath();
    points.forEach((p, i) => { const [x, y] = this.px(p); if (i) pen.lineTo(x, y); else pen.moveTo(x, y); });
    if (!open) pen.closePath();
    if (fill) { pen.fillStyle = fill; pen.fill(); }
    if (stroke) { pen.strokeStyle = stroke; pen.lineWidth = width; pen.setLineDash(dash); pen.stroke(); pen.setLineDash([]); }
  }
  dot(p, radius, fill, stroke = "#fff") {
    const [x, y] = this.px(p), pen = this.pen;
    pen.beginPath(); pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fillStyle = fill; pen.fill(); pen.strokeStyle = stroke; pen.lineWidth = 1; pen.stroke();
  }
  text(words, x, y, align = "left", color = "#555") {
    this.pen.fillStyle = color; this.pen.font = "11px system-ui, sans-serif"; this.pen.textAlign = align;
    this.pen.fillText(words, x, y);
  }
  ticks(unitX, unitY) {
    const far = [this.at(0, this.h), this.at(this.w, 0)];
    this.text(unitX, this.w - 4, this.h - 4, "right");
    this.text(unitY, 3, 11);
    const right = this.w - this.pen.measureText(unitX).width - 20; // a number farther right would lie over the unit
    for (const axis of [0, 1]) {
      const step = niceStep((far[1][axis] - far[0][axis]) / 6);
      for (let v = Math.ceil(far[0][axis] / step) * step; v < far[1][axis]; v += step) {
        const [x, y] = this.px(axis ? [this.middle[0], v] : [v, this.middle[1]]);
        const label = String(Number(v.toPrecision(6)));
        if (axis === 0 && x > 40 && x < right) this.text(label, x, this.h - 4, "center");
        if (axis === 1 && y > 20 && y < this.h - 16) this.text(label, 3, y + 4);
      }
    }
  }
}

function niceStep(rough) {
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((m) => m * power >= rough);
}
