// Plots over time on a canvas: a band from lowest to highest, a line through the means, what is allowed.
"use strict";
const nice = (low, high, count) => {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough)), step = [1, 2, 2.5, 5, 10].map(m => m * power).find(s => s >= rough * .999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
};
const short = v => v === null || !isFinite(v) ? "–" : Math.abs(v) < 1e-9 ? "0" : Math.abs(v) >= 1000 ? v.toFixed(0) : String(+v.toPrecision(3));
const ruled = (v, step) => { // with as many digits as tell it from the next one
  const digits = [0, 1, 2, 3, 4, 5].find(d => Math.abs(step * 10 ** d - Math.round(step * 10 ** d)) < 1e-6 * step * 10 ** d);
  return Math.abs(v) < 1e-9 * step ? "0" : digits === undefined ? v.toExponential(1) : v.toFixed(digits);
};
const LEAST = .01; // of the way between two limits: what moves less fills no plot
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
class Plot {
  constructor(canvas, said, channels, specs) {
    Object.assign(this, {canvas, said, channels, specs, cursor: null});
    const move = event => { const box = canvas.getBoundingClientRect(); this.cursor = event.clientX - box.left; this.dirty = true; };
    canvas.addEventListener("pointermove", move); canvas.addEventListener("pointerdown", move);
    canvas.addEventListener("pointerleave", () => { this.cursor = null; this.dirty = true; });
  }
  draw(frames, from, to, rate, now) {
    const canvas = this.canvas, ratio = devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
    if (!w || !h) return;
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) { canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio); }
    const c = canvas.getContext("2d"), bottom = 17;
    c.setTransform(ratio, 0, 0, ratio, 0, 0); c.clearRect(0, 0, w, h);
    const shown = frames.filter(f => f.mean.length && this.channels.every(k => f.mean[k] !== null) && f.tick / rate >= from && f.tick / rate <= to);
    let low = Infinity, high = -Infinity;
    for (const f of shown) for (const k of this.channels) { low = Math.min(low, f.low[k]); high = Math.max(high, f.high[k]); }
    if (low > high) { low = 0; high = 1; }
    const spec = this.specs[this.channels[0]], limits = this.channels.length === 1 ? [spec.lower, spec.upper].filter(v => v !== null) : [];
    for (const v of limits) if (v > low - 2 * (high - low) - .2 && v < high + 2 * (high - low) + .2) { low = Math.min(low, v); high = Math.max(high, v); }
    const least = limits.length === 2 ? LEAST * (limits[1] - limits[0]) - (high - low) : 0;
    if (least > 0) { low -= least / 2; high += least / 2; }
    const air = .08 * (high - low) || .1 * Math.abs(high) || 1; low -= air; high += air;
    c.font = "11px system-ui, sans-serif";
    const rules = nice(low, high, 4), labels = rules.map(v => ruled(v, rules[1] - rules[0])), left = Math.max(44, ...labels.map(text => c.measureText(text).width + 12));
    const X = t => left + (w - left - 6) * (t - from) / (to - from), Y = v => 4 + (h - bottom - 4) * (1 - (v - low) / (high - low));
    c.fillStyle = css("--soft"); c.strokeStyle = css("--grid"); c.lineWidth = 1; c.textAlign = "right"; c.textBaseline = "middle";
    rules.forEach((v, i) => { c.beginPath(); c.moveTo(left, Y(v)); c.lineTo(w - 6, Y(v)); c.stroke(); c.fillText(labels[i], left - 6, Math.max(Y(v), 7)); });
    c.textAlign = "center"; c.textBaseline = "alphabetic";
    for (const t of nice(from, to, w / 90)) if (X(t) > left + 8 && X(t) < w - 26) c.fillText(short(+t.toFixed(6)), X(t), h - 3);
    c.textAlign = "right"; c.fillText("s", w - 7, h - 3);
    c.save(); c.beginPath(); c.rect(left, 0, w - left - 6, h - bottom + 2); c.clip();
    if (limits.length) {
      c.fillStyle = css("--band"); const top = spec.upper === null ? 0 : Y(spec.upper), end = spec.lower === null ? h : Y(spec.lower); c.fillRect(left, top, w, end - top);
      c.strokeStyle = css("--edge"); c.setLineDash([5, 4]); for (const v of limits) { c.beginPath(); c.moveTo(left, Y(v)); c.lineTo(w, Y(v)); c.stroke(); } c.setLineDash([]);
    }
    this.channels.forEach((k, i) => {
      c.strokeStyle = c.fillStyle = css(`--c${i % 6 + 1}`);
      c.globalAlpha = .3; c.beginPath(); shown.forEach((f, j) => c[j ? "lineTo" : "moveTo"](X(f.tick / rate), Y(f.high[k])));
      for (let j = shown.length - 1; j >= 0; j--) c.lineTo(X(shown[j].tick / rate), Y(shown[j].low[k])); c.fill();
      c.globalAlpha = 1; c.lineWidth = 1.5; c.beginPath(); shown.forEach((f, j) => c[j ? "lineTo" : "moveTo"](X(f.tick / rate), Y(f.mean[k]))); c.stroke();
    });
    const rule = x => { c.strokeStyle = css("--soft"); c.lineWidth = 1; c.beginPath(); c.moveTo(x, 0); c.lineTo(x, h); c.stroke(); };
    if (now !== null) rule(X(now));
    let at = null;
    if (this.cursor !== null && this.cursor >= left && shown.length) {
      rule(this.cursor);
      const t = from + (this.cursor - left) / (w - left - 6) * (to - from);
      at = shown.reduce((a, b) => Math.abs(b.tick / rate - t) < Math.abs(a.tick / rate - t) ? b : a);
    }
    this.tell(at, rate);
    c.restore();
  }
  tell(frame, rate) { // the values under the cursor; of several lines which is which, always
    const several = this.channels.length > 1, unit = this.specs[this.channels[0]].unit;
    const words = this.channels.map(k => [several ? this.specs[k].name.slice(-1) : "", frame ? short(frame.mean[k]) : ""].filter(text => text).join(" "));
    const key = words.filter(text => text).map((text, i) => Object.assign(document.createElement("b"), {textContent: text, style: several ? `color:var(--c${i % 6 + 1})` : ""}));
    this.said.replaceChildren(...key, ...(frame ? [`${unit} at ${(frame.tick / rate).toFixed(2)} s`] : []));
  }
}
function histogram(canvas, counts, bars, name) {
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  if (!w) return;
  canvas.width = w * ratio; canvas.height = h * ratio;
  const c = canvas.getContext("2d"), end = Math.max(24, counts.findLastIndex(n => n) + 2), most = Math.max(1, ...counts), wide = w / end;
  c.setTransform(ratio, 0, 0, ratio, 0, 0); c.clearRect(0, 0, w, h); c.fillStyle = css(name);
  counts.forEach((n, i) => { if (n) { const high = (h - 16) * (Math.log10(n) + .3) / (Math.log10(most) + .3); c.fillRect(i * wide + .5, h - 16 - high, wide - 1, high); } });
  c.fillStyle = css("--soft"); c.font = "11px system-ui, sans-serif"; c.textAlign = "center";
  const unit = c.measureText("us").width + 6;
  for (const us of [10, 100, 1000, 10000]) { const x = (Math.log2(us / bars.least) * bars.per_octave + 1) * wide; const half = c.measureText(us).width / 2; if (x > half && x + half < w - unit) c.fillText(us, x, h - 3); }
  c.textAlign = "right"; c.fillText("us", w - 1, h - 3);
}
