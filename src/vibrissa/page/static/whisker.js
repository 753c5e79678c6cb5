// The whisker on its texture in slow motion: the whole of it, and close to the contact.
import { inks, opened, rounded } from "./plots.js";

const $ = id => document.getElementById(id);
const TAPER = [0.5, 1.3, 2.1, 3, 4];
const CLOSE = 1.6e-3, LEFT = 0.3; // [m] across the near view, and the share of it before the contact on the flat
const JUMP = 2e-5, GOOD = 3e-4, SHOWN = 6e-3; // [m] least jump that is told, and one that is seen well; [s] for which its arrow is seen

export function surfaceAt(data, place) { // height of the surface [m]
  const { surface } = data, n = surface.length / 2;
  if (place < surface[0]) return surface[n];
  if (place >= surface[n - 1]) return surface[2 * n - 1];
  let low = 0, high = n - 1;
  while (high - low > 1) { const middle = (low + high) >> 1; if (surface[middle] <= place) low = middle; else high = middle; }
  const step = surface[high] - surface[low];
  return surface[n + low] + (step > 0 ? (place - surface[low]) / step * (surface[n + high] - surface[n + low]) : 0);
}

export function shaftAt(data, time) { // positions of the shaft from the base [m]
  const points = data.shaft.length, moments = data.shaft_time.length, step = moments > 1 ? data.shaft_time[1] : 1;
  const at = Math.min(moments - 1, Math.max(0, time / step)), first = Math.min(Math.floor(at), Math.max(0, moments - 2)), share = Math.min(1, at - first);
  const second = Math.min(first + 1, moments - 1), out = { x: new Float32Array(points), y: new Float32Array(points) };
  for (let i = 0; i < points; i++) for (const axis of ["x", "y"]) {
    const values = data[`shaft_${axis}`];
    out[axis][i] = (1 - share) * values[first * points + i] + share * values[second * points + i];
  }
  return out;
}

// Where on the shaft the contact is, as an index with its fraction; what comes before it is the free end.
export function contactAt({ x }, place) {
  let i = 1;
  while (i < x.length - 1 && x[i] < place) i++;
  return i - 1 + Math.min(1, Math.max(0, (place - x[i - 1]) / (x[i] - x[i - 1])));
}

const LEAST_END = 2e-4; // [m] below which a shaft has no free end to speak of

// How deep the free end lies below the ground at its worst [m]; the model has one contact and does not resolve it.
export function freeEndDepth(data, time, { x, y }, contact) {
  let worst = 0;
  const near = x[0] + 0.97 * (between(x, contact) - x[0]); // the contact itself vibrates by some micrometres
  for (let at = 0; at < contact; at += 1 / 6) {
    const px = between(x, at);
    if (px < near) worst = Math.max(worst, surfaceAt(data, px + data.distance + data.speed * time) - (between(y, at) + data.height));
  }
  return worst;
}

const between = (values, at) => { const i = Math.min(values.length - 2, Math.floor(at)); return values[i] + (at - i) * (values[i + 1] - values[i]); };

function drawShaft(ctx, { x, y }, contact, X, Y, touching, width, steps = [1], dash = [5, 3]) { // steps: how much wider each part is on the way to the base, in pixels
  const ink = inks(), split = [X(between(x, contact)), Y(between(y, contact))];
  const run = (points, paint, dash, line) => {
    ctx.strokeStyle = paint; ctx.lineWidth = line; ctx.setLineDash(dash);
    ctx.beginPath();
    for (const point of points) ctx.lineTo(...point);
    ctx.stroke(); ctx.setLineDash([]);
  };
  const all = Array.from(x, (v, i) => [X(v), Y(y[i])]), first = Math.floor(contact) + 1;
  run([...all.slice(0, first), split], touching ? ink.bad : ink.two, dash, touching || !dash.length ? width + 1 : width);
  const held = [split, ...all.slice(first)], at = i => Math.round(i * (held.length - 1) / steps.length);
  steps.forEach((more, i) => run(held.slice(at(i), at(i + 1) + 1), ink.one, [], width + more));
}

const dashOf = data => data.model === "rod" ? [] : [5, 3]; // of the free end: dashed where the model leaves it out

function drawGround(ctx, data, time, X, Y, bottom, from, to) { // between two places from the base [m]
  const ink = inks(), shift = data.speed * time + data.distance, { surface } = data, n = surface.length / 2;
  const left = from + shift, right = to + shift;
  ctx.beginPath();
  ctx.moveTo(X(from), bottom + 5);
  ctx.lineTo(X(from), Y(-data.height + surfaceAt(data, left)));
  for (let k = 0; k < n; k++) if (surface[k] >= left && surface[k] <= right) ctx.lineTo(X(surface[k] - shift), Y(-data.height + surface[n + k]));
  ctx.lineTo(X(to), Y(-data.height + surfaceAt(data, right)));
  ctx.lineTo(X(to), bottom + 5);
  ctx.closePath();
  ctx.fillStyle = ink.ground; ctx.fill();
  ctx.strokeStyle = ink.ink; ctx.lineWidth = 1; ctx.stroke();
}

function whole(data, time, pose, rest, magnify, contact, touching) {
  const place = opened($("whole")), { ctx, width, height } = place, ink = inks();
  const low = Math.min(...rest.x), scale = Math.min((width - 30) / (-low * 1.06), (height - 40) / (data.height * 1.12));
  const X = v => width - 18 + v * scale, Y = v => 14 - v * scale;
  drawGround(ctx, data, time, X, Y, height, (15 - width) / scale, 21 / scale);
  if (data.gaps) barcode(ctx, data, time, X, Y(-data.height) + 6, scale, width);
  const large = { x: pose.x.map((v, i) => rest.x[i] + magnify * (v - rest.x[i])), y: pose.y.map((v, i) => rest.y[i] + magnify * (v - rest.y[i])) };
  drawShaft(ctx, large, contact, X, Y, touching, 1.5, TAPER, dashOf(data));
  ctx.fillStyle = ink.ink; ctx.fillRect(X(0) - 2, Y(0) - 8, 14, 16);
  rule(ctx, 10, 14, 5e-3 * scale, "5 mm");
  if (height > 180) named(ctx, data, large, contact, X, Y, width);
}

function named(ctx, data, { x, y }, contact, X, Y, width) { // what is what in the drawing
  const ground = Y(-data.height), free = X(between(x, contact)) - X(x[0]) > 20;
  const say = (text, at, above, side = "right") => { ctx.fillStyle = inks().ink; ctx.textAlign = side; ctx.textBaseline = "middle"; ctx.fillText(text, at, above); };
  say("whisker pad", X(0) - 10, Y(0) - 6);
  say("thick base", X(x.at(-3)) - 12, Math.max(Y(0) + 22, Y(y.at(-3))));
  say("thin tip", Math.max(4, X(x[0]) - 8), ground - 12, "left");
  if (free) say("free end", (X(x[0]) + X(between(x, contact))) / 2, ground - 28, "center");
  say("contact ↓", X(between(x, contact)) + 3, ground - (free ? 44 : 28), "center");
  say(data.gaps ? "← the surface moves; its gaps are blank" : "← surface moves", width - 8, ground + 26);
}

function barcode(ctx, data, time, X, top, scale, width) { // gaps are too shallow to be seen at this scale
  const { surface } = data, n = surface.length / 2, shift = data.speed * time + data.distance;
  ctx.fillStyle = inks().back;
  for (let k = 0; k < n; k += 4) {
    const x = X(surface[k] - shift);
    if (x < width && x > -50) ctx.fillRect(x, top, Math.max(1, (surface[k + 2] - surface[k]) * scale), 7);
  }
}

function rule(ctx, x, y, length, text) {
  ctx.strokeStyle = ctx.fillStyle = inks().ink; ctx.lineWidth = 2;
  ctx.beginPath(); ctx.moveTo(x, y); ctx.lineTo(x + length, y); ctx.stroke();
  ctx.textAlign = "left"; ctx.textBaseline = "top"; ctx.fillText(text, x, y + 4);
}

const NEAR = { canvas: "close", across: CLOSE, left: LEFT, stretch: 1, title: "" };

export function close(data, time, { pose, d, contact, touching, depth }, { canvas, across, left, stretch, title } = NEAR) {
  const place = opened($(canvas)), { ctx, width, height } = place, ink = inks(), scale = width / across;
  const X = v => width * left + (v + data.distance) * scale, Y = v => height * 0.6 - (v + data.height) * scale * stretch;
  const at = pixel => (pixel - width * left) / scale - data.distance;
  drawGround(ctx, data, time, X, Y, height, at(-3), at(width + 3));
  drawShaft(ctx, pose, contact, X, Y, touching, 2, [1], dashOf(data));
  const where = { x: X(-data.distance - d), y: Y(-data.height + heldAt(data, time, d)) };
  ctx.fillStyle = ink.ink;
  if (Number.isFinite(d)) { ctx.beginPath(); ctx.arc(where.x, where.y, 4.5, 0, 7); ctx.fill(); }
  rule(ctx, 10, 14, 3e-4 * scale, stretch === 1 ? "0.3 mm, to scale" : `0.3 mm, heights × ${stretch}`);
  jumpArrow(ctx, data, time, where, X);
  if (height > 180) {
    ctx.textAlign = "center"; ctx.textBaseline = "bottom"; ctx.fillStyle = ink.ink;
    if (Number.isFinite(d)) ctx.fillText("contact", where.x, where.y - 8);
    if (data.gaps) gapNames(ctx, data, time, X, Y, width);
  }
  if (title) { ctx.font = "600 12px system-ui, sans-serif"; ctx.textAlign = "right"; ctx.textBaseline = "top"; ctx.fillStyle = ink.ink; ctx.fillText(title, width - 8, 10); }
  if (touching) warned(ctx, `free end ${rounded(1e6 * depth, 2)} µm below ground: a second contact, not modelled`, width, height);
}

function heldAt(data, time, d) { // height of the contact [m]
  const ground = surfaceAt(data, data.speed * time - d - 1e-9);
  return data.gaps ? Math.max(0, ground) : ground; // an edge of a gap carries it at the height of the land
}

function warned(ctx, text, width, height) {
  ctx.textAlign = "left"; ctx.textBaseline = "bottom";
  const lines = wrapped(ctx, text, width - 12), ink = inks();
  ctx.fillStyle = ink.card; ctx.fillRect(0, height - 8 - 14 * lines.length, 8 + Math.max(...lines.map(line => ctx.measureText(line).width)), 8 + 14 * lines.length);
  ctx.fillStyle = ink.bad;
  lines.reverse().forEach((line, i) => ctx.fillText(line, 4, height - 4 - 14 * i));
}

// Jumps of the contact: places in the record where it moves farther in one sample than the surface carries it.
export function jumpsOf(data) {
  return data.jumps ??= Array.from(data.excursion.keys()).filter(i => i && Math.abs(data.excursion[i] - data.excursion[i - 1]) > 3 * data.speed / data.rate + JUMP);
}

export function nextJump(data, time) { // [s] just after it, around the end
  const after = jumpsOf(data).find(i => i / data.rate > time + 1e-9);
  return after === undefined ? (jumpsOf(data)[0] ?? 0) / data.rate : after / data.rate;
}

export function goodMoment(data) { // [s] at a jump of ordinary size, where one sees what the page is about
  const size = i => Math.abs(Math.abs(data.excursion[i] - data.excursion[i - 1]) - GOOD), jumps = [...jumpsOf(data)], early = jumps.filter(i => i < data.excursion.length / 3);
  const all = (early.length ? early : jumps).sort((a, b) => size(a) - size(b));
  const best = all.find(i => !posed(data, i / data.rate).touching) ?? all[0];
  return (best ?? 0) / data.rate;
}

function jumpArrow(ctx, data, time, { y }, X) { // for some milliseconds after a jump: from where to where
  const now = time * data.rate + 1e-6, i = jumpsOf(data).findLast(one => one <= now);
  if (i === undefined || now - i > SHOWN * data.rate) return;
  const from = X(-data.distance - data.excursion[i - 1]), to = X(-data.distance - data.excursion[i]), high = y - 30, side = Math.sign(to - from);
  if (Math.abs(to - from) < 8) return;
  ctx.strokeStyle = ctx.fillStyle = inks().bad; ctx.lineWidth = 2;
  ctx.beginPath(); ctx.moveTo(from, high); ctx.lineTo(to, high); ctx.moveTo(to - 6 * side, high - 4); ctx.lineTo(to, high); ctx.lineTo(to - 6 * side, high + 4); ctx.stroke();
  ctx.textAlign = "center"; ctx.textBaseline = "bottom"; ctx.fillText("jump", (from + to) / 2, high - 3);
}

function gapNames(ctx, data, time, X, Y, width) { // below each gap that is in sight
  const { surface } = data, n = surface.length / 2, shift = data.speed * time + data.distance;
  ctx.textBaseline = "top";
  for (let k = 0; k < n; k += 4) {
    const middle = X((surface[k] + surface[k + 2]) / 2 - shift);
    if (middle > 12 && middle < width - 12) ctx.fillText("gap", middle, Y(-data.height + surface[n + k + 1]) + 4);
  }
}

function wrapped(ctx, text, width) { // lines of whole words
  const lines = [];
  for (const word of text.split(" ")) {
    const longer = lines.length ? `${lines.at(-1)} ${word}` : word;
    if (lines.length && ctx.measureText(longer).width <= width) lines[lines.length - 1] = longer; else lines.push(word);
  }
  return lines;
}

export function posed(data, time) { // shaft, contact, and whether the free end lies below ground
  const pose = shaftAt(data, time), d = data.excursion[Math.min(data.excursion.length - 1, Math.round(time * data.rate))];
  const contact = Number.isFinite(d) ? contactAt(pose, -data.distance - d) : 0;
  const depth = data.model === "rod" ? 0 : freeEndDepth(data, time, pose, contact); // the rod touches wherever it reaches the ground
  const length = between(pose.x, contact) - pose.x[0]; // of the free end; a contact at the tip moves by some micrometres
  return { pose, d, contact, depth, touching: depth > 2e-6 && length > LEAST_END };
}

export function drawMotion(data, time, magnify) {
  const points = data.shaft.length, is = posed(data, time);
  const rest = { x: data.shaft_x.subarray(0, points), y: data.shaft_y.subarray(0, points) };
  whole(data, time, is.pose, rest, magnify, is.contact, is.touching);
  close(data, time, is);
}

export function describeMotion(data) {
  const text = `H ${rounded(1e3 * data.height)} mm, contact at ε = ${rounded(data.contact)}, scanned at ${rounded(1e3 * data.speed)} mm/s`;
  $("whole").setAttribute("aria-label", `Whisker and texture: ${text}`);
  $("close").setAttribute("aria-label", "The contact from near by, jumping from edge to edge");
}
