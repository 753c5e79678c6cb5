// Tip contact against a long free end: the same whisker cut at its contact and whole, over the same surface.
import { axes, boxOf, inks, opened, range, rounded, ticks, trace } from "./plots.js";
import { close, posed } from "./whisker.js";

const $ = id => document.getElementById(id);
const VIEW = { across: 2.4e-3, left: 0.62, stretch: 4 }; // [m] in sight, share of it before the contact, how much heights are drawn larger

const SEEN = 6e-4; // [m] excursion at which the contact is well in sight

export const compares = data => data?.model === "rod";

export function showBridge(data) { // whether the figure came or went
  const figure = $("bridge"), was = figure.hidden;
  figure.hidden = !compares(data);
  if (figure.hidden) return was !== figure.hidden;
  const ends = [data.cut_tip, data.tip].map(tip => `${rounded(1e3 * (data.contact - tip) * data.length, 2)} mm`);
  $("bridge-about").textContent = `one whisker over texture A, computed whole (rod): ${ends[0]} of free end beyond the contact, or ${ends[1]}; ${size(data.less)}`;
  $("cut-close").setAttribute("aria-label", `The contact of the whisker cut to ${ends[0]} of free end, from near by`);
  $("free-close").setAttribute("aria-label", `The contact of the whisker with ${ends[1]} of free end, from near by`);
  return was !== figure.hidden;
}

const size = less => less > 1.05 ? `with the long one it vibrates ${rounded(less, 2)} times less` : `with the long one it vibrates ${rounded(1 / less, 2)} times as much`;

function withoutEnd(data) { // the cut whisker, by the names of the whole one
  const own = () => Object.entries(data).filter(([name]) => name.startsWith("cut_")).map(([name, values]) => [name.slice(4), values]);
  return data.cut ??= { ...data, jumps: null, ...Object.fromEntries(own()) };
}

export function bridgeMoment(data) { // [s] when the cut tip is deepest in a gap that the whole whisker bridges, the contact in sight
  const cut = withoutEnd(data), points = cut.shaft.length, inSight = time => Math.abs(cut.excursion[Math.round(time * data.rate)]) < SEEN;
  let best = 0, low = Infinity;
  cut.shaft_time.forEach((time, p) => { if (cut.shaft_y[p * points] < low && inSight(time)) { low = cut.shaft_y[p * points]; best = time; } });
  return best;
}

export function drawBridge(data, time) {
  if (!compares(data)) return;
  const cut = withoutEnd(data), last = (cut.excursion.length - 1) / data.rate;
  close(cut, Math.min(time, last), posed(cut, Math.min(time, last)), { ...VIEW, canvas: "cut-close", title: "Cut at the contact" });
  close(data, time, posed(data, time), { ...VIEW, canvas: "free-close", title: "With its free end" });
}

export function bridgeTrace(data, end) {
  if (!compares(data)) return;
  const place = opened($("bridge-trace")), ink = inks(), box = boxOf(place), { ctx } = place;
  const [cut, whole] = [data.cut_displacement, data.displacement].map(one => one.map(v => 1e6 * v));
  const limits = range(cut, 1e-3), far = ticks([0, 0.9 * Math.max(...limits)], 3).at(-1);
  const map = axes(place, box, [0, end], limits, { x: "time [s]", y: "moves [µm]", ySteps: [-far, 0, far] });
  trace(place, map, cut, 1 / data.rate, ink.one);
  trace(place, map, whole, 1 / data.rate, ink.two, { width: 1.6 });
  ctx.textAlign = "right"; ctx.textBaseline = "top";
  [["cut at the contact", ink.one], ["with its free end", ink.two]].forEach(([text, paint], i) => { ctx.fillStyle = paint; ctx.fillText(text, box.left + box.width, box.top + 15 * i); });
  $("bridge-trace").setAttribute("aria-label", `Displacement 5 millimetres from the base: ${size(data.less)}`);
}
