// Lines of the movie, their names and pieces, as the server gives them.

const COLOURS = ["#56c8ff", "#ffb000", "#3ddc84", "#ff7ac8", "#f2e641", "#ff6b3d", "#a98bff", "#17e0cf", "#ffa98f", "#b6f25c", "#d9a35f", "#7f9cff", "#ff5d7e", "#8ad7b0"];
const DOUBTFUL = 0.95; // lines less sure are places to look at
const LONGEST = 12; // letters of a name in a picture
export const GREY = "#c4c9d0";
export const colour = whisker => whisker >= 0 ? COLOURS[whisker % COLOURS.length] : GREY;

export class Tracks {
  constructor(message) {
    Object.assign(this, { frames: message.frames, width: message.width, height: message.height, numbers: message.numbers, part: message.part });
    for (const name of ["frame", "start", "angle", "column", "row"]) this[name] = message[name];
    this.count = this.frame.length;
    this.first = new Int32Array(this.frames + 1).fill(this.count);
    for (let s = this.count - 1; s >= 0; s--) this.first[this.frame[s]] = s;
    for (let f = this.frames - 1; f >= 0; f--) this.first[f] = Math.min(this.first[f], this.first[f + 1]);
    this.take(message);
  }

  take(message) { // names after an edit
    const before = this.whisker;
    for (const name of ["whisker", "other", "sure", "piece", "whiskers", "names", "edits", "undone", "unsaved"]) this[name] = message[name];
    this.indexPieces();
    this.doubts = this.findDoubts();
    this.compare(before ?? this.whisker);
  }

  compare(before) { // frames in which a line has another name than before, and how many lines went from which name to which
    const frames = new Set();
    this.ways = {};
    for (let s = 0; s < this.count; s++) if (this.whisker[s] !== before[s]) {
      const way = `${before[s]} ${this.whisker[s]}`;
      frames.add(this.frame[s]);
      this.ways[way] = (this.ways[way] ?? 0) + 1;
    }
    this.changed = [...frames];
  }

  indexPieces() { // segments of piece p: members[from[p]] … members[from[p + 1] - 1], by frames
    let most = 0;
    for (let s = 0; s < this.count; s++) if (this.piece[s] > most) most = this.piece[s];
    this.from = new Int32Array(most + 2);
    for (let s = 0; s < this.count; s++) this.from[this.piece[s] + 1] += 1;
    for (let p = 0; p <= most; p++) this.from[p + 1] += this.from[p];
    const next = this.from.slice();
    this.members = new Int32Array(this.count);
    for (let s = 0; s < this.count; s++) this.members[next[this.piece[s]]++] = s;
    this.pieces = most + 1;
  }

  shown(k) { return this.numbers[k] ?? Number(k); } // the number in the profile
  name(k) { // that was given, or its beginning as a picture has room for it, else the number
    const name = [...(this.names[k] ?? String(this.shown(k)))];
    return name.length > LONGEST ? `${name.slice(0, LONGEST - 1).join("")}…` : name.join("");
  }
  both(k) { return k in this.names ? `${this.names[k]} (${this.shown(k)})` : String(this.shown(k)); }
  number(text) { // whisker of a name or of a number that is shown
    const same = k => this.names[k].toLowerCase() === text.toLowerCase(), at = this.numbers.indexOf(Number(text));
    return Number(Object.keys(this.names).find(same) ?? (at >= 0 ? at : text));
  }
  spelt(text) { // a line of the server, with names
    const both = text.replace(/\b(whiskers) (\d+) and (\d+)/gi, (_, word, a, b) => `${word} ${this.both(a)} and ${this.both(b)}`);
    return both.replace(/\b(whisker) (\d+)/gi, (_, word, k) => `${word} ${this.both(k)}`);
  }
  report(answer) { // what an edit did: frames whose names it changed, lines by their names before and after, and the line of the server
    if (answer.called === null) return `${this.where()}. ${this.spelt(answer.said)}`;
    const whisker = this.shown(answer.called), called = `${whisker} is called ${this.names[answer.called] ?? whisker}`;
    return { edit: `Whisker ${called}`, undo: `Undone: whisker ${called} again`, redo: `Redone: whisker ${called}` }[answer.did];
  }
  where() {
    const all = this.changed, label = k => k >= 0 ? this.both(k) : k === "-2" ? "no whisker" : "no name";
    if (!all.length) return "No names changed";
    const ways = Object.entries(this.ways).map(([way, n]) => `${way.split(" ").map(label).join(" → ")}: ${n} line${n === 1 ? "" : "s"}`);
    return `Names changed in ${all.length === 1 ? `frame ${all[0]}` : `${all.length} frames from ${all[0]} to ${all.at(-1)}`}. ${ways.join("; ")}`;
  }
  points(s) { return [this.start[s], s + 1 < this.count ? this.start[s + 1] : this.column.length]; }
  size(s) { const [a, b] = this.points(s); return b - a; }
  segmentsOf(p) { return this.members.subarray(this.from[p], this.from[p + 1]); }
  inFrame(f) { const out = []; for (let s = this.first[f]; s < this.first[f + 1]; s++) out.push(s); return out; }
  byAngle(f) { return this.inFrame(f).sort((a, b) => this.angle[a] - this.angle[b]); }

  main(p) { // of each frame of a piece its longest line
    const out = [];
    for (const s of this.segmentsOf(p)) {
      const last = out[out.length - 1];
      if (last === undefined || this.frame[last] !== this.frame[s]) out.push(s);
      else if (this.size(s) > this.size(last)) out[out.length - 1] = s;
    }
    return out;
  }

  inPiece(p, f) { // its longest line in a frame, or null
    let best = null;
    for (const s of this.segmentsOf(p)) if (this.frame[s] === f && (best === null || this.size(s) > this.size(best))) best = s;
    return best;
  }

  ends(p) { const all = this.segmentsOf(p); return [this.frame[all[0]], this.frame[all[all.length - 1]]]; }

  nearest(f, column, row, reach) { // line of a frame at a place [px], or null
    let best = null, least = reach;
    for (let s = this.first[f]; s < this.first[f + 1]; s++) {
      const [a, b] = this.points(s);
      for (let i = a; i < b; i++) {
        const j = Math.min(i + 1, b - 1), dx = this.column[j] - this.column[i], dy = this.row[j] - this.row[i];
        const along = Math.max(0, Math.min(1, ((column - this.column[i]) * dx + (row - this.row[i]) * dy) / (dx * dx + dy * dy || 1)));
        const off = Math.hypot(this.column[i] + along * dx - column, this.row[i] + along * dy - row);
        if (off < least) { least = off; best = s; }
      }
    }
    return best;
  }

  seen() { // share of the tracked frames in which each whisker has a line
    const last = new Int32Array(this.whiskers).fill(-1), count = new Int32Array(this.whiskers);
    for (let s = 0; s < this.count; s++) {
      const k = this.whisker[s];
      if (k >= 0 && last[k] !== this.frame[s]) { last[k] = this.frame[s]; count[k] += 1; }
    }
    const [first, end] = this.part;
    return Array.from(count, n => n / (end - first + 1));
  }

  findDoubts() { // where a named piece ends before the tracked part does, and where its name becomes doubtful
    const found = [];
    for (let p = 0; p < this.pieces; p++) {
      const all = this.segmentsOf(p);
      if (!(this.whisker[all[0]] >= 0)) continue;
      let doubted = false;
      for (const s of all) {
        const now = this.sure[s] < DOUBTFUL;
        if (now && !doubted) found.push(s);
        doubted = now;
      }
      if (this.frame[all[all.length - 1]] < this.part[1]) found.push(all[all.length - 1]);
    }
    return found.sort((a, b) => this.frame[a] - this.frame[b] || a - b);
  }

  describe(s) {
    const k = this.whisker[s], [a, b] = this.ends(this.piece[s]), all = this.byAngle(this.frame[s]);
    const name = k >= 0 ? `whisker ${this.both(k)}, ${(100 * this.sure[s]).toFixed(this.sure[s] > 0.99 && this.sure[s] < 1 ? 1 : 0)} % sure` : k === -2 ? "deleted, no whisker" : "no name";
    const shared = this.other[s] >= 0 ? `; whisker ${this.both(this.other[s])} is along the same line` : "";
    return `line ${all.indexOf(s) + 1} of ${all.length}: ${name}${shared}; its piece is frames ${a} to ${b}`;
  }
}
