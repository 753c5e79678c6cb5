// The page to correct tracks: what is selected, moves sent to the server one after the other, what comes back.
import { View } from "./drawing.js";
import { Frames } from "./frames.js";
import { actOf, listKeys } from "./keys.js";
import { unpacked } from "./messages.js";
import { Overview } from "./overview.js";
import { colour, Tracks } from "./state.js";

const $ = id => document.getElementById(id);
const PLAYED = 30; // frames per second
const REACH = 12; // [CSS px] a click is on a line
const ASKED = {
  name: "This piece is whisker", mark: "This line, in this frame, is whisker", swap: "From this frame on, exchange names with whisker", go: "Go to frame",
};

const OF_NAMED = ["swap", "call"], OF_LINE = ["mark", "delete-line"]; // what needs a name, and a line in this frame

let tracks, frames, view, overview;
let frame = 0, selected = null, piece = null, anchor = null, asking = null, playing = 0, ended = false;
let deaf = 0; // until when letters are no keys
let queue = Promise.resolve(), waiting = 0, speaking = 0, drawn = 0, painting = false;
const times = { scrub: [], move: [] }; // [ms] from the hand to the picture

// Pictures

const painted = then => requestAnimationFrame(() => setTimeout(then)); // once the next picture is on the screen

function draw() {
  if (painting) return; // several changes, one picture
  painting = true;
  requestAnimationFrame(() => {
    painting = false;
    view.draw(frame, selected, anchor);
    overview.draw(frame, selected, anchor);
    drawn += 1;
  });
}

function timed(kind, since) { painted(() => times[kind].push(performance.now() - since)); }

function resize() { view.resize(); overview.resize(); draw(); }

// Where

function go(to, since = performance.now()) {
  frame = Math.min(Math.max(Math.round(to), 0), tracks.frames - 1);
  if (piece !== null) selected = tracks.inPiece(tracks.piece[piece], frame); // the selected piece is followed
  $("slider").value = $("frame").value = frame;
  $("slider").setAttribute("aria-valuetext", `frame ${frame} of ${tracks.frames}`);
  overview.follow(frame);
  frames.show(frame, () => { draw(); timed("scrub", since); });
  tell();
}

function select(segment) { // a line, and with it its piece
  if (asking && asking.kind !== "go") unask(); // it was about another one
  piece = segment; // a line by which the piece is known, also where it has none
  if (segment !== null && tracks.frame[segment] !== frame) go(tracks.frame[segment]);
  selected = segment;
  draw();
  tell();
}

function step(way, onlyNamed) { // next line of this frame, by angle; a line without a name stays the place to go on from
  const all = tracks.byAngle(frame).filter(s => !onlyNamed || s === selected || tracks.whisker[s] >= 0);
  if (!all.length) return;
  const at = all.indexOf(selected);
  select(all[at < 0 ? (way > 0 ? 0 : all.length - 1) : (at + way + all.length) % all.length]);
}

function doubt(way) {
  const known = tracks.doubts, here = s => tracks.frame[s] * way > frame * way || (tracks.frame[s] === frame && selected !== null && (s - selected) * way > 0);
  const next = way > 0 ? known.find(here) : known.findLast(here);
  if (next === undefined) return say("no such place further on");
  select(next);
}

function tell() { // after a rest, so that a reader of the screen is not drowned; while the movie plays, now and then
  if (playing && speaking) return;
  clearTimeout(speaking);
  speaking = setTimeout(() => {
    speaking = 0;
    const lost = piece !== null && selected === null;
    const [first, last] = tracks.part, outside = frame < first || frame > last ? `not tracked, which is frames ${first} to ${last}; ` : "";
    $("where").textContent = `Frame ${frame} of ${tracks.frames}; ${outside}` + (selected !== null ? tracks.describe(selected)
      : lost ? `the selected piece has no line here: it is frames ${tracks.ends(tracks.piece[piece]).join(" to ")}` : "no line selected: click on one, or ↑ ↓");
    for (const name of ["name", "mark", "join", "split", "swap", "delete", "delete-line", "call"]) button(name).disabled = ended || (OF_NAMED.includes(name) ? !(named() >= 0) : piece === null);
    for (const name of OF_LINE) button(name).disabled ||= selected === null;
    button("join").setAttribute("aria-pressed", String(anchor !== null));
    for (const one of $("whiskers").children) one.firstChild.classList.toggle("chosen", Number(one.dataset.whisker) === named());
  }, playing ? 500 : 60);
}

const button = name => document.querySelector(`[data-key="${name}"]`);
const named = () => piece === null ? -1 : tracks.whisker[piece];

function say(text, bad = false) { $("message").textContent = text; $("message").className = bad ? "bad" : ""; }

// Moves

async function post(place, body) {
  const reply = await fetch(place, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  if (!reply.ok) throw new Error((await reply.json()).error);
  return reply;
}

function move(place, body = {}, refused = failed) {
  if (ended) return;
  const since = performance.now();
  waiting += 1;
  queue = queue.then(async () => {
    try {
      took(unpacked(await (await post(place, body)).arrayBuffer()));
      timed("move", since);
    } catch (error) { refused(error); }
    waiting -= 1;
  });
}

function took(answer) {
  tracks.take(answer);
  overview.redraw();
  list();
  say(tracks.report(answer));
  draw();
  tell();
}

function failed(error) { say(error instanceof TypeError ? "The program that serves this page has ended." : tracks?.spelt(error.message) ?? error.message, true); }

function list() {
  const seen = tracks.seen(), items = [], every = [...seen.keys()].sort((a, b) => tracks.shown(a) - tracks.shown(b));
  for (const k of every) {
    const item = document.createElement("li"), one = document.createElement("button"), swatch = document.createElement("span");
    item.dataset.whisker = k;
    one.type = "button";
    one.title = tracks.both(k); // it may be longer than the list is wide
    swatch.className = "swatch";
    swatch.style.background = colour(k);
    one.append(swatch, `${tracks.both(k)}: ${Math.floor(100 * seen[k])} %`);
    one.setAttribute("aria-label", `Whisker ${tracks.both(k)}, a line in ${Math.floor(100 * seen[k])} % of the frames`);
    one.onclick = () => find(k);
    item.append(one);
    items.push(item);
  }
  $("whiskers").replaceChildren(...items);
  $("counts").textContent = `${tracks.whiskers} whiskers, ${tracks.edits} edit${tracks.edits === 1 ? "" : "s"} in ${tracks.file}`;
  button("undo").disabled = ended || !tracks.edits;
  button("redo").disabled = ended || !tracks.undone;
}

function find(k) { // its line that is nearest in time
  let best = null;
  for (let s = 0; s < tracks.count; s++) if (tracks.whisker[s] === k && (best === null || Math.abs(tracks.frame[s] - frame) < Math.abs(tracks.frame[best] - frame))) best = s;
  if (best === null) say(`whisker ${tracks.both(k)} has no line`); else select(best);
}

function edit(kind, more = {}, refused) {
  const at = selected ?? piece;
  if (at === null) return say("select a line first: click on one, or ↑ ↓", true);
  const whole = ["name", "delete"].includes(kind) && !more.alone && $("whole").checked ? { whole: true } : {};
  move("edit", { do: kind, at, ...whole, ...more }, refused);
}

function join() {
  if (anchor === null) {
    if (piece === null) return say("select the first piece", true);
    anchor = selected ?? piece;
    say("Select the piece to join with, and press j again; Esc gives up.");
    draw();
  } else {
    const to = anchor;
    anchor = null;
    if (piece === null) say("no piece to join with was selected: the join is given up", true);
    else edit("join", { to }, error => {
      failed(error);
      if (error instanceof TypeError) return; // nobody answers any more
      $("message").textContent += ". Select another piece and press j; Esc gives up.";
      anchor ??= to;
      draw();
      tell();
    });
  }
  tell();
}

function split() {
  if (selected === null && piece !== null) return say("the selected piece has no line in this frame: go to one in which it has", true);
  edit("split");
}

function deleteLine() {
  if (selected === null && piece !== null) return say("the selected piece has no line in this frame", true);
  edit("delete", { alone: true });
}

// Questions

function ask(kind, text = "") {
  if (kind !== "go" && piece === null) return unasked("select a line first: click on one, or ↑ ↓");
  if (OF_NAMED.includes(kind) && !(named() >= 0)) return unasked("select a line that has a name: Shift+↑ ↓");
  if (kind === "mark" && selected === null) return unasked("the selected piece has no line in this frame");
  if (playing) play();
  asking = { kind, from: document.activeElement };
  const few = kind === "go" ? `0 to ${tracks.frames - 1}` : `0 to ${tracks.whiskers - 1}${known()}` + (kind === "name" ? `, or + for a new one` : "");
  $("asked").textContent = kind === "call" ? `Whisker ${tracks.both(named())} is called (such as C2)` : `${ASKED[kind]} (${few})`;
  $("number").value = text || (kind === "call" ? tracks.names[named()] ?? "" : "");
  $("number").inputMode = kind === "call" ? "text" : "numeric";
  $("ask").hidden = false;
  $("number").focus();
  $("number").select();
}

function unasked(why) { // what is typed as the answer must not be taken for keys
  deaf = performance.now() + 1500;
  say(why, true);
}

function known() { const all = Object.values(tracks.names); return all.length ? `, or ${all.join(", ")}` : ""; }

function unask() {
  say("");
  $("ask").hidden = true;
  const from = asking?.from;
  asking = null;
  (from && from !== document.body && from !== $("number") ? from : $("view")).focus({ preventScroll: true });
}

function answered(event) {
  event.preventDefault();
  const { kind } = asking, text = $("number").value.trim();
  if (kind === "call") return call(text);
  const number = kind === "name" && text === "+" ? tracks.whiskers : kind === "go" ? Number(text) : tracks.number(text);
  const most = kind === "go" ? tracks.frames - 1 : kind === "name" ? tracks.whiskers : tracks.whiskers - 1;
  if (text === "" || !Number.isInteger(number) || number < 0 || number > most) {
    $("number").select();
    return say(`a whole number from 0 to ${kind === "name" ? `${most - 1}, or + for a new one` : most}${kind === "go" ? "" : known()}, got ${text || "nothing"}${kind === "mark" && text === "+" ? "; n names a new whisker" : ""}`, true);
  }
  unask();
  if (kind === "go") return go(number);
  if (kind === "swap") return number === named() ? say("the same whisker twice", true) : move("edit", { do: "swap", frame, whiskers: [named(), number] });
  edit(kind, { whisker: number });
}

function call(label) { // a name that is refused can be changed
  const whisker = named(), line = selected ?? piece;
  unask();
  move("edit", { do: "call", whisker, label }, error => {
    if ((selected ?? piece) === line) ask("call", label);
    failed(error);
  });
}

async function save() {
  if (ended) return;
  say("Saving …");
  queue = queue.then(async () => { // whoever ends waits for it
    try { say(await (await post("save", {})).text()); tracks.unsaved = false; } catch (error) { failed(error); }
  });
  await queue;
}

async function end() {
  await queue;
  try { await post("end", {}); } catch { /* it has ended already: what is said next holds */ }
  ended = true;
  tell();
  list();
  for (const one of [$("end"), button("save")]) one.disabled = true;
  say(`Ended: edits are kept${tracks.unsaved ? ", but the profile was not saved with them" : ""}. You may close this page.`);
}

// Hands

const ACTS = {
  back: event => go(frame - (event.shiftKey ? 10 : 1), event.timeStamp), on: event => go(frame + (event.shiftKey ? 10 : 1), event.timeStamp),
  "far-back": event => go(frame - 50, event.timeStamp), "far-on": event => go(frame + 50, event.timeStamp),
  first: event => go(0, event.timeStamp), last: event => go(tracks.frames - 1, event.timeStamp),
  up: event => step(-1, event.shiftKey), down: event => step(1, event.shiftKey),
  begin: () => piece !== null && go(tracks.ends(tracks.piece[piece])[0]), finish: () => piece !== null && go(tracks.ends(tracks.piece[piece])[1]),
  "doubt-back": () => doubt(-1), "doubt-on": () => doubt(1), changed: () => tracks.changed.length ? go(tracks.changed[0]) : say("No names changed."),
  name: () => ask("name"), mark: () => ask("mark"), swap: () => ask("swap"), go: () => ask("go"),
  join, split, delete: () => edit("delete"), "delete-line": deleteLine, call: () => ask("call"), whole: () => { $("whole").checked = !$("whole").checked; say($("whole").checked ? "Name and delete concern all pieces of the whisker." : "Name and delete concern one piece."); },
  undo: () => move("undo"), redo: () => move("redo"), save, play,
  shorter: () => { overview.zoom(1 / 1.6, frame); draw(); }, longer: () => { overview.zoom(1.6, frame); draw(); }, all: () => { overview.zoom(Infinity, frame); draw(); },
  angles: () => { overview.toggleRange(); button("angles").setAttribute("aria-pressed", String(overview.every)); draw(); },
  "zoom-in": () => { view.zoomAt(1.4); draw(); }, "zoom-out": () => { view.zoomAt(1 / 1.4); draw(); }, fit: () => { view.fit(); draw(); },
  help: () => { $("help").open = !$("help").open; if ($("help").open) $("help").scrollIntoView(); },
  escape: () => { if (asking) unask(); else if (anchor !== null) { anchor = null; say(""); draw(); tell(); } else select(null); },
};

function keys(event) {
  if (event.target.id === "number") { if (event.key === "Escape") { event.preventDefault(); unask(); } return; }
  const { tagName, type } = event.target;
  if (tagName === "INPUT" && type === "number") return;
  if ((event.key === " " || event.key === "Enter") && ["BUTTON", "SUMMARY", "INPUT"].includes(tagName)) return;
  const act = actOf(event);
  if (!act || (performance.now() < deaf && event.key.length === 1)) return;
  event.preventDefault();
  if (playing && act !== "play") play();
  ACTS[act](event);
}

function play() {
  playing = playing ? (clearInterval(playing), 0) : setInterval(() => { if (frame >= tracks.frames - 1) play(); else if (frames.has(frame)) go(frame + 1); }, 1000 / PLAYED);
  $("play").setAttribute("aria-pressed", String(Boolean(playing)));
  $("play").textContent = playing ? "Stop" : "Play";
  tell();
}

function bindView() {
  let held = null;
  const canvas = $("view");
  canvas.onpointerdown = event => { canvas.setPointerCapture(event.pointerId); held = { x: event.clientX, y: event.clientY, left: view.left, top: view.top, moved: false }; };
  canvas.onpointermove = event => {
    if (!held) return;
    held.moved ||= Math.hypot(event.clientX - held.x, event.clientY - held.y) > 4;
    if (!held.moved) return;
    const ratio = canvas.width / canvas.getBoundingClientRect().width;
    view.left = held.left - (event.clientX - held.x) * ratio / view.zoom;
    view.top = held.top - (event.clientY - held.y) * ratio / view.zoom;
    view.fitted = false;
    draw();
  };
  canvas.onpointerup = event => {
    if (held && !held.moved) select(tracks.nearest(frame, ...view.place(event), REACH * (devicePixelRatio || 1) / view.zoom));
    held = null;
  };
  canvas.onpointercancel = () => { held = null; };
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    const box = canvas.getBoundingClientRect(), ratio = canvas.width / box.width;
    view.zoomAt(Math.exp(-event.deltaY * 0.0015), (event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio);
    draw();
  }, { passive: false });
}

function bindOverview() {
  let held = null;
  const canvas = $("overview");
  canvas.onpointerdown = event => { canvas.setPointerCapture(event.pointerId); held = { x: event.clientX, moved: false }; };
  canvas.onpointermove = event => {
    if (!held) return;
    held.moved ||= Math.abs(event.clientX - held.x) > 4;
    if (held.moved) go(overview.frameAt(event), event.timeStamp);
  };
  canvas.onpointerup = event => {
    if (held && !held.moved) { const s = overview.hit(event); if (s === null) go(overview.frameAt(event), event.timeStamp); else select(s); }
    held = null;
  };
  canvas.onpointercancel = () => { held = null; };
  canvas.addEventListener("wheel", event => { event.preventDefault(); overview.zoom(Math.exp(event.deltaY * 0.0015), overview.frameAt(event)); draw(); }, { passive: false });
}

function bind() {
  bindView();
  bindOverview();
  document.addEventListener("keydown", keys);
  for (const one of document.querySelectorAll("[data-key]")) one.onclick = event => ACTS[one.dataset.key](event);
  $("slider").max = $("frame").max = tracks.frames - 1;
  $("slider").oninput = event => go($("slider").valueAsNumber, event.timeStamp);
  $("frame").onchange = () => Number.isFinite($("frame").valueAsNumber) ? go($("frame").valueAsNumber) : go(frame);
  $("play").onclick = play;
  $("ask").onsubmit = answered;
  $("cancel").onclick = unask;
  $("end").onclick = end;
  new ResizeObserver(resize).observe($("view"));
  new ResizeObserver(resize).observe($("overview"));
}

async function start() {
  const message = unpacked(await (await fetch("lines")).arrayBuffer());
  tracks = new Tracks(message);
  tracks.file = message.edits_file;
  $("title").textContent = message.name;
  document.title = `Correct: ${message.name} – vibrissa`;
  frames = new Frames(tracks.width, tracks.height, tracks.frames, line => say(line, true));
  view = new View($("view"), tracks, frames);
  overview = new Overview($("overview"), tracks);
  listKeys($("keys"));
  bind();
  resize();
  list();
  go(tracks.part[0]);
  globalThis.correct = {
    tracks, view, overview, times, drawn: () => drawn, frame: () => frame, selected: () => selected, piece: () => piece, anchor: () => anchor,
    busy: () => waiting > 0 || painting || !frames.has(frame) || frames.shown !== frame, select, go, Y: angle => overview.Y(angle), X: f => overview.X(f),
  };
}

start().catch(failed);
