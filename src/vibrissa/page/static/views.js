// The views of one prediction; `data` holds facts and float32 arrays as vibrissa.page.signals names them.
import { bridgeTrace } from "./bridge.js";
import { palette } from "./palette.js";
import { axes, boxOf, inks, MARGIN, opened, path, range, ticks, rounded, trace } from "./plots.js";

const $ = id => document.getElementById(id);
const MODES = ["one", "two", "three"];
const row = (array, i, n) => array.subarray(i * n, (i + 1) * n);
const step = (data, values) => data.excursion.length / values.length / data.rate; // [s] of what may be sketched: fewer samples
const say = (id, text) => $(id).setAttribute("aria-label", text);

const VIEWS = { "bridge-trace": bridgeTrace, excursion, modes, "moment-view": moment, spectrogram, resonance, firing };
const inSight = id => { const box = $(id).getBoundingClientRect(); return box.bottom > 0 && box.top < innerHeight; };
let later = [], rest = 0;

export const drawing = () => later.length > 0;

// What is in sight at once, the rest when the hands have rested for `pause` ms; then `done` is called.
export function drawAll(data, pause, done) {
  const end = (data.excursion.length - 1) / data.rate;
  later = Object.keys(VIEWS);
  const draw = wanted => { later = later.filter(id => !wanted(id) || VIEWS[id](data, end)); };
  draw(inSight);
  clearTimeout(rest);
  rest = setTimeout(() => { draw(() => true); done(); }, pause);
}

function excursion(data, end) {
  const place = opened($("excursion")), um = data.excursion.map(v => v * 1e6), [low, high] = range(um, 1);
  const map = axes(place, boxOf(place), [0, end], [low, high], { x: "time [s]", y: "d [µm]" });
  trace(place, map, um, 1 / data.rate, inks().one);
  say("excursion", `Excursion of the contact from ${rounded(Math.min(...extremes(um)))} to ${rounded(Math.max(...extremes(um)))} micrometres in ${rounded(end)} seconds`);
}

function extremes(values) { let low = Infinity, high = -Infinity; for (const v of values) { if (v < low) low = v; if (v > high) high = v; } return [low, high]; }

function modes(data, end) {
  const place = opened($("modes")), n = data.shape.modes[1], ink = inks(), whole = boxOf(place);
  const said = [];
  for (let i = 0; i < 3; i++) {
    const values = row(data.modes, i, n), envelope = row(data.envelopes, i, n), middle = data.mean[i];
    const top = 1.08e6 * Math.max(1e-12, extremes(envelope)[1], extremes(values)[1] - middle, middle - extremes(values)[0]);
    const box = { ...whole, top: whole.top + i * whole.height / 3, height: whole.height / 3 - 8 };
    const far = ticks([0, 0.9 * top], 3).at(-1), steps = [-far, 0, far];
    const map = axes(place, box, [0, end], [-top, top], { x: i === 2 ? "time [s]" : "", y: `q${"₁₂₃"[i]} [µm]`, ySteps: steps });
    for (const sign of [1, -1]) trace(place, map, envelope, step(data, envelope), ink.pale, { width: 1, scale: sign * 1e6 });
    trace(place, map, values, step(data, values), ink[MODES[i]], { width: 1, scale: 1e6, offset: middle });
    tagged(place.ctx, box.left + box.width, box.top, `mode ${i + 1}${data.rod_frequency ? "" : `, ${rounded(data.frequency[i])} Hz`}`);
    said.push(`mode ${i + 1} at ${rounded(data.frequency[i])} hertz, rms ${rounded(1e6 * data.rms[i])} micrometres`);
  }
  say("modes", said.join("; "));
}

function tagged(ctx, right, top, text) { // on the colour of the card, so that it is read over a curve
  const width = ctx.measureText(text).width;
  ctx.globalAlpha = 0.75; ctx.fillStyle = inks().card; ctx.fillRect(right - width - 2, top - 1, width + 4, 14); ctx.globalAlpha = 1;
  ctx.fillStyle = inks().ink; ctx.textAlign = "right"; ctx.textBaseline = "top"; ctx.fillText(text, right, top);
}

function moment(data, end) {
  const place = opened($("moment-view")), margin = { ...MARGIN, right: 52 }, box = boxOf(place, margin), ink = inks();
  const unit = 1e9 / data.curvature_by_moment, nano = data.moment.map(v => v * 1e9), limits = range(nano, 1e-6);
  const map = axes(place, box, [0, end], limits, { x: "time [s]", y: "moment [nN m]" });
  trace(place, map, nano, step(data, nano), ink.one);
  const { ctx } = place;
  ctx.fillStyle = ink.pale; ctx.textAlign = "left"; ctx.textBaseline = "middle";
  for (const v of ticks(limits.map(m => m / unit), box.height / 35)) ctx.fillText(rounded(v, 6), box.left + box.width + 4, map.Y(v * unit));
  ctx.save(); ctx.translate(place.width - 8, box.top + box.height / 2); ctx.rotate(-Math.PI / 2); ctx.textAlign = "center";
  ctx.fillText("curvature [1/m]", 0, 0); ctx.restore();
  const [low, high] = extremes(nano);
  say("moment-view", `Bending moment at the base from ${rounded(low)} to ${rounded(high)} nanonewton metres`);
}

const inks32 = Uint32Array.from({ length: 256 }, (_, i) => (255 << 24 | palette[3 * i + 2] << 16 | palette[3 * i + 1] << 8 | palette[3 * i]) >>> 0);

function spectrogram(data, end) {
  const place = opened($("spectrogram")), [bins, columns] = data.shape.spectrogram, [, top, first, last] = data.spectrogram_axes;
  const margin = { ...MARGIN, right: 64 }, box = boxOf(place, margin), map = axes(place, box, [0, end], [0, top], { x: "time [s]", y: "frequency [Hz]" });
  const high = extremes(data.spectrogram)[1], low = high - 60, image = new ImageData(columns, bins);
  const pixels = new Uint32Array(image.data.buffer);
  for (let f = 0; f < bins; f++) for (let k = 0; k < columns; k++) {
    const share = (data.spectrogram[f * columns + k] - low) / 60;
    pixels[(bins - 1 - f) * columns + k] = inks32[Math.round(255 * Math.min(1, Math.max(0, share)))];
  }
  const sheet = new OffscreenCanvas(columns, bins);
  sheet.getContext("2d").putImageData(image, 0, 0);
  const { ctx } = place, half = columns > 1 ? (last - first) / (columns - 1) / 2 : end / 2;
  const left = map.X(Math.max(0, first - half)), right = map.X(Math.min(end, last + half));
  ctx.drawImage(sheet, left, box.top, right - left, box.height);
  (data.rod_frequency ?? data.frequency).forEach((hertz, i) => resonanceLine(ctx, box, map.Y(hertz), `mode ${i + 1}: ${rounded(hertz)} Hz`));
  scaleBar(ctx, box, high);
  let strongest = 0;
  for (let k = 0; k < data.spectrogram.length; k++) if (data.spectrogram[k] > data.spectrogram[strongest]) strongest = k;
  say("spectrogram", `Spectrogram up to ${rounded(top)} hertz, strongest at ${rounded(Math.floor(strongest / columns) * top / (bins - 1))} hertz`);
}

function resonanceLine(ctx, box, y, text) { // its colours do not depend on the light: those of the picture do not either
  const right = box.left + box.width, width = ctx.measureText(text).width;
  if (y < box.top) return;
  ctx.strokeStyle = "rgb(255 255 255 / 60%)"; ctx.lineWidth = 1; ctx.setLineDash([2, 4]);
  ctx.beginPath(); ctx.moveTo(box.left, y); ctx.lineTo(right, y); ctx.stroke(); ctx.setLineDash([]);
  ctx.fillStyle = "rgb(0 20 50 / 80%)"; ctx.fillRect(right - width - 10, y - 9, width + 8, 18);
  ctx.fillStyle = "#fff"; ctx.textAlign = "right"; ctx.textBaseline = "middle"; ctx.fillText(text, right - 6, y);
}

function scaleBar(ctx, box, high) {
  for (let k = 0; k < box.height; k++) {
    const from = 3 * Math.round(255 * (1 - k / box.height));
    ctx.fillStyle = `rgb(${palette[from]} ${palette[from + 1]} ${palette[from + 2]})`;
    ctx.fillRect(box.left + box.width + 8, box.top + k, 10, 1.5);
  }
  ctx.fillStyle = inks().pale; ctx.textAlign = "left"; ctx.textBaseline = "middle";
  [0, -30, -60].forEach((level, i) => ctx.fillText(rounded(Math.round(high + level)), box.left + box.width + 22, box.top + 5 + i * (box.height - 10) / 2));
  ctx.fillText("dB", box.left + box.width + 22, box.top + 20);
}

function resonance(data) {
  const place = opened($("resonance")), n = data.resonance.length / 4, ink = inks(), contacts = [...row(data.resonance, 0, n)];
  const margin = { ...MARGIN, right: 104 }, box = boxOf(place, margin), toKappa = 2 * Math.PI * data.timescale;
  const shown = contacts.map((c, i) => [c, i]).filter(([c]) => c <= 0.7).map(([, i]) => i);
  const steps = [5, 10, 20, 50, 100, 200, 500, 1000];
  const map = axes(place, box, [0, 0.7], [8, 1500], { x: "contact ε", y: "κ", log: true, ySteps: steps.filter(v => v >= 8) });
  for (let i = 0; i < 3; i++) {
    const hertz = row(data.resonance, i + 1, n);
    place.ctx.save(); place.ctx.beginPath(); place.ctx.rect(box.left, box.top, box.width, box.height); place.ctx.clip();
    path(place, map, shown.map(k => contacts[k]), shown.map(k => hertz[k] * toKappa), ink[MODES[i]], 1.8);
    place.ctx.restore();
    const { ctx } = place, y = map.Y(data.frequency[i] * toKappa);
    ctx.fillStyle = ink.ink;
    ctx.beginPath(); ctx.arc(map.X(data.contact), y, 4, 0, 7); ctx.fill();
    ctx.textAlign = "left"; ctx.textBaseline = "middle";
    ctx.fillText(`mode ${i + 1}: ${rounded(data.frequency[i])} Hz`, box.left + box.width + 3, Math.max(box.top + 6, y));
  }
  place.ctx.strokeStyle = ink.ink; place.ctx.lineWidth = 1; place.ctx.setLineDash([4, 4]);
  place.ctx.beginPath(); place.ctx.moveTo(map.X(data.contact), box.top); place.ctx.lineTo(map.X(data.contact), box.top + box.height); place.ctx.stroke();
  place.ctx.setLineDash([]);
  say("resonance", `Contact at ${rounded(data.contact)} of the length: resonances ${data.frequency.map(f => rounded(f)).join(", ")} hertz`);
}

// Envelope with its threshold, the rate that follows, the spikes drawn from it; pale where the envelope is above.
function firing(data, end) {
  const place = opened($("firing")), ink = inks(), box = boxOf(place), part = box.height / 3, um = 1e6 * data.threshold;
  const panel = k => ({ ...box, top: box.top + k * part, height: part - 12 });
  const peaks = [1e6 * extremes(data.drive)[1], extremes(data.firing)[1]];
  const high = panel(0), low = panel(2), top = 1.1 * Math.max(um, peaks[0], 1e-3), fast = 1.1 * Math.max(1, peaks[1]);
  above(place, data, high, low, end);
  const envelope = axes(place, high, [0, end], [0, top], { y: "env. [µm]" });
  trace(place, envelope, data.drive, step(data, data.drive), ink.two, { scale: 1e6, width: 1.6 });
  dashed(place, [high.left, high.left + high.width], envelope.Y(um), "threshold");
  trace(place, axes(place, panel(1), [0, end], [0, fast], { y: "rate [Hz]" }), data.firing, step(data, data.firing), ink.one, { width: 1.6 });
  raster(place, axes(place, { ...low, height: part }, [0, end], [0, 12], { x: "time [s]", y: "trial", ySteps: [0, 6, 12] }), data);
  say("firing", `Envelope up to ${rounded(peaks[0])} micrometres, threshold ${rounded(um)}; firing rate from ${rounded(extremes(data.firing)[0])} to ${rounded(peaks[1])} hertz, ${rounded(data.spikes.length / 24)} spikes a trial`);
}

function above({ ctx }, { drive, threshold, ...data }, high, low, end) {
  const pixel = high.width / end * step(data, drive);
  ctx.fillStyle = inks().line;
  for (let i = 0; i < drive.length; i++) {
    const from = i;
    while (i < drive.length && drive[i] > threshold) i++;
    if (i > from) ctx.fillRect(high.left + from * pixel, high.top, (i - from) * pixel, low.top + low.height + 12 - high.top);
  }
}

function dashed({ ctx }, [from, to], y, name) {
  const ink = inks();
  ctx.strokeStyle = ctx.fillStyle = ink.ink; ctx.lineWidth = 1.2; ctx.setLineDash([5, 4]);
  ctx.beginPath(); ctx.moveTo(from, y); ctx.lineTo(to, y); ctx.stroke();
  ctx.setLineDash([]); ctx.textAlign = "right"; ctx.textBaseline = "bottom";
  ctx.fillText(name, to, y - 1);
}

function raster({ ctx }, map, { spikes }) {
  const n = spikes.length / 2, pitch = map.Y(0) - map.Y(1);
  ctx.strokeStyle = inks().ink; ctx.lineWidth = 1.2; ctx.beginPath();
  for (let k = 0; k < n; k++) {
    const x = map.X(spikes[k]), y = map.Y(spikes[n + k]);
    ctx.moveTo(x, y); ctx.lineTo(x, y - 0.8 * pitch);
  }
  ctx.stroke();
}

export function contrast(data, names) { // names: what the textures are
  const place = opened($("contrast")), ink = inks(), bins = data.counts_a.length, box = boxOf(place);
  const rates = ["a", "b"].map(letter => data[`counts_${letter}`].map(c => c / 0.01));
  const map = axes(place, box, [0, Math.max(0.01, bins * 0.01)], [0, 1.5 * Math.max(1, ...rates[0], ...rates[1])], { x: "time [s]", y: "rate [Hz]" });
  rates.forEach((values, k) => trace(place, map, values, 0.01, ink[MODES[k]], { width: 2, dash: k ? [6, 3] : [] }));
  place.ctx.textAlign = "right"; place.ctx.textBaseline = "top";
  ["A —", "B - -"].forEach((sign, k) => { place.ctx.fillStyle = ink[MODES[k]]; place.ctx.fillText(`${sign} ${names[k]}`, box.left + box.width, box.top + 16 * k); });
  const text = `One neuron, one scan of ${rounded(data.duration)} s, tells them apart ${apart(data.by_course)} by when it fires (d′ = ${rounded(data.by_course)}) and ${apart(data.by_count)} by how often (d′ = ${rounded(data.by_count)}).`;
  $("index").textContent = text;
  say("contrast", text);
}

const apart = d => d > 2 ? "clearly" : d > 1 ? "fairly well" : d > 0.5 ? "poorly" : d > 0.05 ? "hardly" : "not at all"; // an ideal observer errs in 16, 31, 40 %
