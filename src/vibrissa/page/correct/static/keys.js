// Keys and what they do; the page's list of keys is made from the same table.

export const KEYS = [
  ["← →", "frame before, after; with Shift 10 frames", { ArrowLeft: "back", ArrowRight: "on" }],
  ["PageUp PageDown", "50 frames back, on; Home and End: first and last frame", { PageUp: "far-back", PageDown: "far-on", Home: "first", End: "last" }],
  ["↑ ↓", "select the line above, below in the picture of angles, in this frame; with Shift the next one that has a name", { ArrowUp: "up", ArrowDown: "down" }],
  ["[ ]", "first, last frame of the selected piece", { "[": "begin", "]": "finish" }],
  [", .", "previous, next place to look at: a name ends or is less than 95 % sure", { ",": "doubt-back", ".": "doubt-on" }],
  ["n", "the selected piece is whisker …: a number, a name, or + for a new one", { n: "name" }],
  ["m", "the selected line is whisker …, in this frame; the names about it are put right", { m: "mark" }],
  ["j", "join: press it on one piece, select the other one, press it again", { j: "join" }],
  ["s", "split: the name of the selected piece ends before this frame", { s: "split" }],
  ["x", "swap: the selected whisker and … exchange names from this frame on", { x: "swap" }],
  ["d Delete", "the selected piece is no whisker", { d: "delete", Delete: "delete", Backspace: "delete" }],
  ["Shift+D", "the selected line alone, in this frame, is no whisker", { D: "delete-line" }],
  ["c", "the selected whisker is called …, such as C2; nothing takes its name away", { c: "call" }],
  ["w", "name and delete concern all pieces of the whisker", { w: "whole" }],
  ["u r", "undo, redo; Ctrl+Z, Ctrl+Y too", { u: "undo", r: "redo" }],
  ["e", "first frame in which the last edit changed names", { e: "changed" }],
  ["g", "go to frame …", { g: "go" }],
  ["Space", "play", { " ": "play" }],
  ["+ −", "fewer, more frames in the picture of angles; 0: all", { "+": "shorter", "=": "shorter", "-": "longer", 0: "all" }],
  ["v", "in that picture the angles of the whiskers, or of all lines", { v: "angles" }],
  ["z", "zoom in on the frame; Shift+Z out; f: fit", { z: "zoom-in", Z: "zoom-out", f: "fit" }],
  ["Ctrl+S", "save the corrected profile", {}],
  ["Esc", "stop playing; give up a join or a question; select nothing", { Escape: "escape" }],
  ["?", "this list", { "?": "help" }],
];
const ACTS = Object.assign({}, ...KEYS.map(([, , acts]) => acts));

export function actOf(event) { // name of what a key does, or null
  const control = event.ctrlKey || event.metaKey, key = event.key.length === 1 && control ? event.key.toLowerCase() : event.key;
  if (control) return { z: event.shiftKey ? "redo" : "undo", y: "redo", s: "save" }[key] ?? null;
  if (event.altKey) return null;
  return ACTS[key] ?? ACTS[key.toLowerCase()] ?? null;
}

export function listKeys(box) {
  for (const [keys, text] of KEYS) {
    const term = document.createElement("dt");
    for (const one of keys.split(" ")) term.append(Object.assign(document.createElement("kbd"), { textContent: one }));
    box.append(term, Object.assign(document.createElement("dd"), { textContent: text }));
  }
}
