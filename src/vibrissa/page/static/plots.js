// Axes, traces and maps on a canvas; lengths here are CSS pixels.

const probe = document.createElement("canvas").getContext("2d");
function resolved(name) { // light-dark() as a colour that a canvas knows
  const at = document.createElement("i");
  at.style.color = `var(--${name})`;
  document.body.append(at);
  probe.fillStyle = getComputedStyle(at).color;
  at.remove();
  return probe.fillStyle;
}

let known = null;
export function inks() {
  known ??= Object.fromEntries(["back", "ink", "pale", "line", "card", "ground", "one", "two", "three", "bad"].map(n => [n, resolved(n)]));
  return known;
}
export const forgetInks = () => { known = null; };

export function opened(canvas) {
  const ratio = globalThis.devicePixelRatio || 1, { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const ctx = canvas.getContext("2d");
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.clearRect(0, 0, width, height);
  ctx.font = "12px system-ui, sans-serif";
  ctx.lineJoin = "bevel";
  return { ctx, width, height, ratio };
}

export const rounded = (x, digits = 3) => Number.isFinite(x) ? String(Number(x.toPrecision(digits))) : "–";

export function range(values, floor = 0) {
  let low = Infinity, high = -Infinity;
  for (const v of values) { if (v < low) low = v; if (v > high) high = v; }
  if (!(high - low > floor)) { const pad = floor || Math.abs(high) * 0.1 || 1; low -= pad / 2; high += pad / 2; }
  const margin = 0.06 * (high - low);
  return [low - margin, high + margin];
}

export function ticks([low, high], about) {
  const rough = (high - low) / about, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(m => m * power >= rough);
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) out.push(Number((k * step).toPrecision(12)));
  return out;
}

export const MARGIN = { left: 58, right: 12, top: 8, bottom: 36 };

export function axes(place, box, xs, ys, { x = "", y = "", ySteps = null, log = false } = {}) {
  const { ctx } = place, ink = inks();
  const scale = log ? Math.log10 : v => v;
  const [y0, y1] = ys.map(scale);
  const X = v => box.left + (v - xs[0]) / (xs[1] - xs[0]) * box.width;
  const Y = v => box.top + box.height - (scale(v) - y0) / (y1 - y0) * box.height;
  ctx.strokeStyle = ink.line; ctx.fillStyle = ink.pale; ctx.lineWidth = 1;
  ctx.beginPath();
  const across = ySteps || ticks(ys, Math.max(2, box.height / 35));
  for (const v of across) { ctx.moveTo(box.left, Y(v)); ctx.lineTo(box.left + box.width, Y(v)); }
  ctx.stroke();
  ctx.textAlign = "right"; ctx.textBaseline = "middle";
  for (const v of across) ctx.fillText(rounded(v, 6), box.left - 5, Y(v));
  ctx.textAlign = "center"; ctx.textBaseline = "top";
  if (x) {
    for (const v of ticks(xs, Math.max(2, box.width / 90))) ctx.fillText(rounded(v, 6), X(v), box.top + box.height + 4);
    ctx.fillText(x, box.left + box.width / 2, box.top + box.height + 20);
  }
  ctx.save();
  ctx.translate(11, box.top + box.height / 2);
  ctx.rotate(-Math.PI / 2);
  ctx.textBaseline = "middle";
  ctx.fillText(y, 0, 0);
  ctx.restore();
  return { X, Y };
}

export function boxOf({ width, height }, margin = MARGIN) {
  return { left: margin.left, top: margin.top, width: width - margin.left - margin.right, height: height - margin.top - margin.bottom };
}

// Even samples; where several fall on a pixel, a bar from the least to the largest there: no peak is lost, and bars cost a
// tenth of a line that goes to and fro.
export function trace(place, map, values, step, paint, { width = 1.2, scale = 1, offset = 0, dash = [] } = {}) {
  const Y = v => map.Y(scale * (v - offset)), pixel = 1 / place.ratio, perPixel = pixel / (map.X(step) - map.X(0));
  if (perPixel >= 2) return bars(place.ctx, values, map.X(0), Y, pixel, perPixel, paint, width);
  const { ctx } = place;
  ctx.strokeStyle = paint; ctx.lineWidth = width; ctx.setLineDash(dash);
  ctx.beginPath();
  values.forEach((v, i) => ctx.lineTo(map.X(i * step), Y(v)));
  ctx.stroke();
  ctx.setLineDash([]);
}

function bars(ctx, values, left, Y, pixel, perPixel, paint, width) {
  ctx.fillStyle = paint;
  for (let k = 0; k * perPixel < values.length - 1; k++) {
    const end = Math.min(Math.ceil((k + 1) * perPixel), values.length - 1); // the next one's first: bars meet
    let low = Infinity, high = -Infinity;
    for (let j = Math.floor(k * perPixel); j <= end; j++) { if (values[j] < low) low = values[j]; if (values[j] > high) high = values[j]; }
    const a = Y(low), b = Y(high);
    ctx.fillRect(left + k * pixel, Math.min(a, b) - width / 2, pixel, Math.abs(a - b) + width);
  }
}

export function path({ ctx }, { X, Y }, xs, ys, paint, width = 1.5) {
  ctx.strokeStyle = paint; ctx.lineWidth = width;
  ctx.beginPath();
  xs.forEach((x, i) => ctx.lineTo(X(x), Y(ys[i])));
  ctx.stroke();
}
