// The page: state, questions to the server one at a time, and what comes back.
import { bridgeMoment, drawBridge, showBridge } from "./bridge.js";
import { addressOf, build, LONGEST_ADDRESS, nameOf, show, stateFrom } from "./controls.js";
import { keeping, setQuery } from "./keep.js";
import { glossary, presets, stand, unjudged, verdict } from "./lesson.js";
import { unpacked } from "./messages.js";
import { forgetInks } from "./plots.js";
import * as sound from "./sound.js";
import { contrast, drawAll, drawing } from "./views.js";
import { describeMotion, drawMotion, goodMoment, nextJump } from "./whisker.js";

const $ = id => document.getElementById(id);
const TIMED = ["bridge-trace", "excursion", "modes", "moment-view", "spectrogram", "firing"], RIGHT = { "moment-view": 52, spectrogram: 64 };
const REST = 150; // [ms] without a move until the hands are said to rest

let table, made, state, first, data = null, other = null, playing = null;
let time = 0, last = null, paused = matchMedia("(prefers-reduced-motion: reduce)").matches;
let cursors = [], socket = null, flying = null, waiting = null, count = 0, idle = 0, addressing = 0;
let shownCount = 0, lasting = "", touched = 0, computing = false, fresh = true;
const latencies = [], wholes = []; // [ms] from the hand to the pictures in sight, and to all

// Questions

function ask(want) {
  waiting = { want, since: performance.now() };
  if (flying?.want !== "live" || computing) send(); // what takes longer is given up for it
}

function send() {
  if (!waiting || socket?.readyState !== WebSocket.OPEN) return;
  flying = { ...waiting, id: ++count, sent: performance.now() };
  waiting = null;
  socket.send(JSON.stringify({ id: flying.id, want: flying.want, state: Object.fromEntries(state) }));
}

function connect() {
  socket = new WebSocket(new URL("live", location.href.replace(/^http/, "ws").split("#")[0]));
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { lost(false); flying = null; ask("live"); };
  socket.onmessage = event => received(typeof event.data === "string" ? JSON.parse(event.data) : unpacked(event.data));
  socket.onclose = () => { lost(true); progress({}); flying = null; setTimeout(connect, 2000); };
}

function lost(is) { // greyed out, with the command that starts it again
  const was = document.body.classList.contains("lost");
  document.body.classList.toggle("lost", is);
  $("controls").inert = $("presets").inert = is;
  if (is) say(`The page's program has ended. Start it again in a terminal: vibrissa explore '${addressOf(state, table).slice(1)}'`);
  else if (was) say("");
}

function received(answer) {
  const asked = flying;
  if (answer.id !== undefined && answer.id !== null && answer.id !== asked?.id) return; // nobody waits for it any longer
  flying = null;
  progress(answer);
  if (answer.progress !== undefined) { waiting ??= { want: answer.want, since: asked.since }; send(); return; }
  if (answer.want === "live" && !answer.error) {
    if (fresh) time = answer.model === "rod" ? bridgeMoment(answer) : goodMoment(answer);
    fresh = false;
    data = answer;
    redraw(() => framed(() => wholes.push(performance.now() - asked.since)));
    framed(() => { latencies.push(performance.now() - asked.since); shownCount += 1; });
  } else if (answer.want === "notes" && !answer.error) verdict(answer.notes);
  else if (answer.want === "contrast" && !answer.error) { other = answer; $("contrast").parentElement.classList.remove("stale"); $("play-b").disabled = false; contrast(other, names()); replay(); }
  if (answer.want === "live" || !answer.want) say(answer.error || lasting);
  else if (answer.want === "contrast") say(answer.error || "", "index");
  if (answer.want === "live") $("views").classList.toggle("stale", Boolean(answer.error));
  if (waiting) send(); else if (!answer.error) next(answer.want);
}

function next(want) { // when the hands rest: what takes longer
  clearTimeout(idle);
  if (want === "live") idle = setTimeout(() => ask("notes"), 200);
  else if (want === "notes") idle = setTimeout(() => ask("contrast"), 10);
}

function progress({ want, progress: share }) { // the pictures pale and stay until those of the new state are there
  computing = share !== undefined;
  $("computing").hidden = !computing;
  if (computing) $("computing-what").textContent = want === "contrast" ? "Computing texture B too" : "Computing the whole whisker";
  $("share").value = share ?? 0;
  if (!computing) return;
  if (want === "live") { $("views").classList.add("stale"); $("index").textContent = ""; }
  $("contrast").parentElement.classList.add("stale"); // of an older state until its own answer is there
}

const framed = then => requestAnimationFrame(() => setTimeout(then)); // once the next frame is painted

function say(line, id = "error") {
  if (id === "index" && !line) return;
  $(id).textContent = line;
  if (id === "error") $(id).hidden = !line;
}

// State

function changed(name, value) {
  lasting = "";
  if ($("preset-about").textContent) stand(); // no longer that state
  for (const key of [...state.keys()]) if (!(key in table)) state.delete(key);
  state.set(name, value);
  settle();
}

function chosen(preset) {
  lasting = "";
  fresh = true;
  state = new Map(Object.entries(preset));
  settle();
}

function settle() {
  show(made, table, state);
  unjudged();
  clearTimeout(idle);
  touched = performance.now();
  ask("live");
  clearTimeout(addressing);
  addressing = setTimeout(tellAddress, REST); // browsers take few changes of it in a second
}

function tellAddress() {
  addressing = 0;
  const address = addressOf(state, table);
  if (address.length <= LONGEST_ADDRESS) history.replaceState(null, "", address);
  setQuery(address.slice(1));
}

async function dropped(letter, file, settled) {
  say("");
  const query = new URLSearchParams({ name: file.name, ...settled });
  try {
    const reply = await fetch(`texture?${query}`, { method: "POST", body: file });
    if (!reply.ok) { const line = await reply.text(); say(line); made[`${letter}.file`].reveal(line); return []; }
    const { key, notes } = await reply.json();
    made[`${letter}.file`].waiting = false;
    state.set(`${letter}.kind`, "file");
    changed(`${letter}.file`, key);
    return [file.name, ...notes];
  } catch { say(`${file.name} could not be sent`); return []; }
}

// Pictures

function redraw(done = () => {}) {
  if (!data) return;
  if (showBridge(data)) cursors = [];
  drawAll(data, Math.max(0, touched + REST - performance.now()), done);
  describeMotion(data);
  time = Math.min(time, end());
  if (!cursors.length) layCursors();
  motion();
  $("status").textContent = `Contact ε = ${data.contact.toPrecision(3)}, H = ${(1e3 * data.height).toPrecision(3)} mm; resonances ${data.frequency.map(f => Math.round(f)).join(", ")} Hz; scan of ${end().toPrecision(3)} s`;
  replay();
}

const names = () => [..."ab"].map(letter => nameOf(letter, name => state.get(name) ?? table[name].default));
const end = () => (data.excursion.length - 1) / data.rate;

function motion() {
  drawMotion(data, time, Number($("magnify").value));
  drawBridge(data, time);
  $("moment").value = Math.round(1000 * time / end());
  $("moment").setAttribute("aria-valuetext", `${(1e3 * time).toFixed(1)} ms`);
  $("clock").textContent = `${(1e3 * time).toFixed(1)} ms`;
  for (const { line, width } of cursors) line.style.transform = `translateX(${width * time / end()}px)`;
}

function layCursors() { // measured once for a layout: reading it at every frame would cost more than the drawing
  cursors = TIMED.map(id => {
    const canvas = $(id), figure = canvas.parentElement;
    const line = figure.querySelector(".cursor") || figure.appendChild(Object.assign(document.createElement("i"), { className: "cursor" }));
    const { offsetLeft, offsetTop, clientWidth, clientHeight } = canvas;
    Object.assign(line.style, { left: `${offsetLeft + 58}px`, top: `${offsetTop + 8}px`, height: `${clientHeight - 44}px` });
    return { line, width: clientWidth - 58 - (RIGHT[id] || 12) };
  });
}

function tick(now) {
  requestAnimationFrame(tick);
  if (last !== null && now - last < 30) return; // as often as a film: what is saved goes to new pictures
  if (data && !paused && last !== null && !document.hidden && performance.now() > touched + REST && flying?.want !== "live") {
    time = (time + Math.min(0.1, (now - last) / 1000) / Number($("slow").value)) % end();
    motion();
  }
  last = now;
}

// Sound

function samples(letter) { return letter === "a" ? data?.displacement : other?.displacement_b; }

function toggle(letter) {
  if (playing === letter) { sound.stop(); return pressed(null); }
  if (!samples(letter)) return;
  pressed(letter);
  sound.play(samples(letter), data.rate, Number($("octave").value), $("loop").checked, () => { globalThis.vibrissa.ended += 1; if (!$("loop").checked) pressed(null); })
    .then(() => { globalThis.vibrissa.started += 1; });
}

function pressed(letter) {
  playing = letter;
  for (const one of "ab") $(`play-${one}`).setAttribute("aria-pressed", String(one === letter));
}

function replay() { // what sounds follows what is set
  if (playing && $("loop").checked && samples(playing)) sound.play(samples(playing), data.rate, Number($("octave").value), true, () => {});
}

// Hands

function keys(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select, input:not([type=range], [type=checkbox])")) return;
  const seed = step => changed("a.seed", Math.max(0, Number(state.get("a.seed") ?? table["a.seed"].default) + step));
  const act = { a: () => toggle("a"), b: () => toggle("b"), p: pause, j: jump, "[": () => seed(-1), "]": () => seed(1) }[event.key];
  if (act) { event.preventDefault(); act(); }
}

function jump() { if (data) { paused = true; showPause(); time = nextJump(data, time); motion(); } }

function pause() { paused = !paused; showPause(); }
function showPause() { $("pause").setAttribute("aria-pressed", String(paused)); $("pause").textContent = paused ? "Go on" : "Pause"; }

function bind() {
  for (const letter of "ab") $(`play-${letter}`).onclick = () => toggle(letter);
  $("play-b").disabled = true;
  for (const id of ["octave", "loop"]) $(id).onchange = replay;
  $("pause").onclick = pause;
  $("jump").onclick = jump;
  showPause();
  $("moment").oninput = () => { paused = true; showPause(); time = $("moment").valueAsNumber / 1000 * end(); motion(); };
  $("magnify").onchange = () => data && motion();
  document.addEventListener("keydown", keys);
  new ResizeObserver(() => { layCursors(); redraw(); }).observe($("views"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { forgetInks(); redraw(); if (other) contrast(other, names()); });
  document.addEventListener("dragover", event => { event.preventDefault(); document.body.classList.add("over"); });
  document.addEventListener("dragleave", () => document.body.classList.remove("over"));
  document.addEventListener("drop", event => { event.preventDefault(); document.body.classList.remove("over"); const file = event.dataTransfer.files[0]; if (file) made["a.file"].take(file); });
  keeping(() => addressOf(state, table).slice(1));
  globalThis.addEventListener("hashchange", event => read(new URL(event.newURL).hash)); // location may tell of a later replaceState
}

function read(hash) {
  lasting = "";
  stand();
  try { state = stateFrom(hash); if (!state.size) { state = new Map(Object.entries(first.state)); stand(first); } } catch (error) { state = new Map(); lasting = error.message; }
  say(lasting);
  settle();
}

async function start() {
  globalThis.vibrissa = { latencies, wholes, shown: () => shownCount, busy: () => Boolean(flying || waiting || addressing) || drawing(), started: 0, ended: 0, data: () => data, other: () => other, rendered: sound.rendered, at: () => time };
  const answer = await (await fetch("controls.json")).json();
  table = answer.controls;
  first = answer.presets[0];
  state = new Map();
  presets(answer.presets, chosen);
  glossary(answer.symbols);
  made = build($("controls"), table, { changed, dropped });
  bind();
  read(location.hash);
  connect();
  requestAnimationFrame(tick);
}

start();
