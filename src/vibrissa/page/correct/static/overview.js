// Angle of all pieces over time: what has a name in its colour, what has none in grey.
import { colour } from "./state.js";

const LEFT = 46, BOTTOM = 20, RIGHT = 8, TOP = 12; // [CSS px] room for the axes
const NARROWEST = 20; // frames that are shown at least
const NEAR = 14; // [CSS px] a line is hit
const BRIDGED = 4; // frames over which a piece is drawn on
const CHANGED = "#2f3b4f", SIGN = "#8ab8ff"; // behind and above the frames that an edit changed
const STRETCH = 16; // lines of a piece that are drawn as one path

export class Overview {
  constructor(canvas, tracks) {
    Object.assign(this, { canvas, tracks, pen: canvas.getContext("2d", { alpha: false }), base: document.createElement("canvas"), span: [...tracks.part] });
    this.every = false;
    this.fitRange();
  }

  fitRange() { // angles of the whiskers and some room, or of all lines
    const { tracks } = this, named = Array.from(tracks.angle).filter((_, s) => tracks.whisker[s] >= 0);
    const all = Float32Array.from(this.every || !named.length ? tracks.angle : named).sort();
    const low = all[Math.floor(0.002 * all.length)], high = all[Math.floor(0.998 * all.length)];
    const room = (this.every ? 0.03 : 0.15) * (high - low) || 1;
    this.range = [low - room, high + room];
  }

  toggleRange() {
    this.every = !this.every;
    this.fitRange();
    this.redraw();
  }

  resize() {
    const ratio = this.ratio = devicePixelRatio || 1, { canvas, base } = this;
    base.width = canvas.width = Math.round(canvas.clientWidth * ratio);
    base.height = canvas.height = Math.round(canvas.clientHeight * ratio);
    this.redraw();
  }

  get box() {
    const ratio = this.ratio;
    return { ratio, x: LEFT * ratio, y: TOP * ratio, w: this.canvas.width - (LEFT + RIGHT) * ratio, h: this.canvas.height - (TOP + BOTTOM) * ratio };
  }

  X(frame) { const { x, w } = this.box, [a, b] = this.span; return x + w * (frame - a) / Math.max(b - a, 1); }
  Y(angle) { const { y, h } = this.box, [a, b] = this.range; return y + h * (angle - a) / (b - a); }

  frameAt(event) {
    const { x, w } = this.box, bounds = this.canvas.getBoundingClientRect(), [a, b] = this.span;
    const at = (event.clientX - bounds.left) * this.canvas.width / bounds.width;
    return Math.min(Math.max(Math.round(a + (at - x) / w * (b - a)), 0), this.tracks.frames - 1);
  }

  hit(event) { // line at the pointer, or null
    const { tracks } = this, bounds = this.canvas.getBoundingClientRect(), { ratio } = this.box, scale = this.canvas.width / bounds.width;
    const x = (event.clientX - bounds.left) * scale, y = (event.clientY - bounds.top) * scale, f = this.frameAt(event);
    let best = null, least = NEAR * ratio;
    const reach = Math.ceil(NEAR * ratio / Math.max(this.X(1) - this.X(0), 1e-9));
    for (let g = Math.max(0, f - reach); g <= Math.min(tracks.frames - 1, f + reach); g++)
      for (let s = tracks.first[g]; s < tracks.first[g + 1]; s++) {
        const off = Math.hypot(this.X(g) - x, this.Y(tracks.angle[s]) - y) + (tracks.whisker[s] === -2 ? 5 * ratio : 0);
        if (off < least) { least = off; best = s; }
      }
    return best;
  }

  zoom(factor, about) {
    const [a, b] = this.span, all = this.tracks.frames - 1, wide = Math.min(Math.max((b - a) * factor, Math.min(NARROWEST, all)), all);
    const first = Math.min(Math.max(about - (about - a) * wide / Math.max(b - a, 1), 0), all - wide);
    this.span = [first, first + wide];
    this.redraw();
  }

  follow(frame) { // bring a frame into what is shown
    const [a, b] = this.span, wide = b - a;
    if (frame >= a && frame <= b) return;
    const first = Math.min(Math.max(frame - wide / 2, 0), this.tracks.frames - 1 - wide);
    this.span = [first, first + wide];
    this.redraw();
  }

  polyline(pen, lines) {
    const { tracks } = this;
    let last = -Infinity;
    for (const s of lines) {
      const f = tracks.frame[s], x = this.X(f), y = this.Y(tracks.angle[s]);
      if (f - last > BRIDGED) { pen.moveTo(x - 0.5, y); pen.lineTo(x + 0.5, y); } else pen.lineTo(x, y);
      last = f;
    }
  }

  redraw() { // all but what is selected: once for an edit or another stretch of time
    const { tracks, base } = this, pen = base.getContext("2d", { alpha: false }), { ratio, x, y, w, h } = this.box, [a, b] = this.span;
    pen.fillStyle = "#1b1d21";
    pen.fillRect(0, 0, base.width, base.height);
    this.changed(pen);
    this.axes(pen);
    pen.save();
    pen.beginPath(); pen.rect(x, y, w, h); pen.clip();
    pen.lineJoin = "bevel";
    const paths = new Map(), labels = [];
    for (let p = 0; p < tracks.pieces; p++) {
      const [first, last] = tracks.ends(p);
      if (last < a || first > b) continue;
      const k = tracks.whisker[tracks.segmentsOf(p)[0]];
      if (!paths.has(k)) paths.set(k, []);
      paths.get(k).push(p);
    }
    for (const k of [...paths.keys()].sort((m, n) => m - n)) {
      pen.strokeStyle = colour(k);
      pen.globalAlpha = k === -2 ? 0.25 : k < 0 ? 0.6 : 1;
      pen.lineWidth = (k >= 0 ? 1.7 : 1.1) * ratio;
      for (const p of paths.get(k)) {
        const lines = tracks.main(p);
        for (let i = 0; i === 0 || i < lines.length - 1; i += STRETCH) { // long paths take more than their parts
          pen.beginPath();
          this.polyline(pen, lines.slice(i, i + STRETCH + 1));
          pen.stroke();
        }
        if (k >= 0) labels.push(lines[0]);
      }
      pen.globalAlpha = 1;
    }
    this.labels(pen, labels, ratio);
    pen.restore();
  }

  changed(pen) { // frames in which the last edit changed names: ground, a bar above it that the cursor leaves free, arrows to those that are not shown
    const { ratio, x, y, w, h } = this.box, [a, b] = this.span, all = this.tracks.changed;
    for (const f of all) if (f >= a && f <= b) {
      const left = Math.max(Math.floor(this.X(f - 0.5)), x), right = Math.min(Math.ceil(this.X(f + 0.5)), x + w);
      const wide = Math.max(right - left, 3 * ratio); // a frame of a long movie is seen, too
      pen.fillStyle = CHANGED; pen.fillRect(left, y, wide, h);
      pen.fillStyle = SIGN; pen.fillRect(left, y - 10 * ratio, wide, 8 * ratio);
    }
    if (all[0] < a) this.arrow(pen, x, -8 * ratio);
    if (all.at(-1) > b) this.arrow(pen, x + w, 8 * ratio);
  }

  arrow(pen, at, long) {
    const { ratio, y } = this.box;
    pen.fillStyle = SIGN;
    pen.beginPath(); pen.moveTo(at, y - 10 * ratio); pen.lineTo(at + long, y - 5 * ratio); pen.lineTo(at, y); pen.fill();
  }

  labels(pen, firsts, ratio) { // the number where a piece begins, if there is room
    const { tracks } = this, taken = [];
    pen.font = `600 ${11 * ratio}px system-ui, sans-serif`;
    pen.textAlign = "left"; pen.textBaseline = "middle"; pen.lineWidth = 3 * ratio; pen.strokeStyle = "#1b1d21";
    for (const s of firsts.sort((m, n) => tracks.ends(tracks.piece[n])[1] - tracks.frame[n] - tracks.ends(tracks.piece[m])[1] + tracks.frame[m])) {
      const x = Math.max(this.X(tracks.frame[s]), this.box.x) + 3 * ratio, y = this.Y(tracks.angle[s]);
      if (this.X(tracks.ends(tracks.piece[s])[1]) - x < 24 * ratio) continue;
      const k = tracks.whisker[s], crowded = ([u, v, other]) => Math.abs(u - x) < (other === k ? 150 : 22) * ratio && Math.abs(v - y) < (other === k ? 60 : 12) * ratio;
      if (taken.some(crowded)) continue;
      taken.push([x, y, k]);
      pen.strokeText(tracks.name(tracks.whisker[s]), x, y);
      pen.fillStyle = colour(tracks.whisker[s]);
      pen.fillText(tracks.name(tracks.whisker[s]), x, y);
    }
  }

  axes(pen) {
    const { ratio, x, y, w, h } = this.box, [a, b] = this.span, [low, high] = this.range;
    pen.font = `${11 * ratio}px system-ui, sans-serif`;
    pen.fillStyle = "#c3c8cf"; pen.strokeStyle = "#3a3f47"; pen.lineWidth = ratio;
    pen.textAlign = "center"; pen.textBaseline = "top";
    for (const f of ticks(a, b, w / (90 * ratio), 1)) { this.rule(pen, this.X(f), y, this.X(f), y + h); pen.fillText(String(f), this.X(f), y + h + 5 * ratio); }
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (const v of ticks(low, high, h / (42 * ratio))) { this.rule(pen, x, this.Y(v), x + w, this.Y(v)); pen.fillText(`${v}°`, x - 5 * ratio, this.Y(v)); }
  }

  rule(pen, ...ends) { pen.beginPath(); pen.moveTo(ends[0], ends[1]); pen.lineTo(ends[2], ends[3]); pen.stroke(); }

  draw(frame, selected, anchor) {
    const { pen, tracks } = this, { ratio, x, y, w, h } = this.box;
    pen.drawImage(this.base, 0, 0);
    pen.save();
    pen.beginPath(); pen.rect(x, y, w, h); pen.clip();
    pen.lineJoin = pen.lineCap = "round";
    for (const [s, ink] of [[anchor, "#ffe14d"], [selected, "#fff"]]) if (s !== null) {
      pen.beginPath();
      this.polyline(pen, tracks.main(tracks.piece[s]));
      pen.strokeStyle = ink; pen.lineWidth = 5 * ratio; pen.stroke();
      pen.strokeStyle = colour(tracks.whisker[s]); pen.lineWidth = 2 * ratio; pen.stroke();
    }
    pen.strokeStyle = "#fff"; pen.lineWidth = ratio;
    this.rule(pen, this.X(frame), y, this.X(frame), y + h);
    if (selected !== null && tracks.frame[selected] === frame) {
      pen.beginPath(); pen.arc(this.X(frame), this.Y(tracks.angle[selected]), 5 * ratio, 0, 7);
      pen.lineWidth = 2 * ratio; pen.stroke();
    }
    pen.restore();
  }
}

const SHARES = [10, 5, 2, 1, 0.5, 0.2, 0.1]; // of a power of ten

export function ticks(low, high, most, least = 0) { // round values between two, about so many, in steps of at least
  const raw = (high - low) / Math.max(most, 1), power = 10 ** Math.floor(Math.log10(raw)), share = raw / power;
  const steps = SHARES.slice(SHARES.findLastIndex(one => one >= share)).map(one => Math.max(power * one, least)), multiples = step => {
    const out = [];
    for (let v = Math.ceil(low / step) * step; v <= high; v += step) out.push(Number(v.toPrecision(10)));
    return out;
  };
  return multiples(steps.find(step => multiples(step).length > 1) ?? 1); // one tick alone is no scale
}
