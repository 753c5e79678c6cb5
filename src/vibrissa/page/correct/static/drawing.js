// A frame with its lines: zoom, pan, names at the tips.
import { colour } from "./state.js";

export class View {
  constructor(canvas, tracks, frames) {
    Object.assign(this, { canvas, tracks, frames, pen: canvas.getContext("2d", { alpha: false }), zoom: 1, left: 0, top: 0, fitted: true });
  }

  resize() {
    const ratio = devicePixelRatio || 1, { canvas } = this;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    if (this.fitted) this.fit();
  }

  fit() {
    const { canvas, tracks } = this;
    this.fitted = true;
    this.zoom = Math.min(canvas.width / tracks.width, canvas.height / tracks.height);
    this.left = (tracks.width - canvas.width / this.zoom) / 2;
    this.top = (tracks.height - canvas.height / this.zoom) / 2;
  }

  zoomAt(factor, x = this.canvas.width / 2, y = this.canvas.height / 2) {
    const column = x / this.zoom + this.left, row = y / this.zoom + this.top;
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.1), 40);
    this.left = column - x / this.zoom;
    this.top = row - y / this.zoom;
    this.fitted = false;
  }

  place(event) { // of the pointer, in pixels of the movie; the centre of the first one is 0
    const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
    return [(event.clientX - box.left) * ratio / this.zoom + this.left - 0.5, (event.clientY - box.top) * ratio / this.zoom + this.top - 0.5];
  }

  draw(frame, selected, anchor) {
    const { pen, canvas, tracks, frames, zoom, left, top } = this, ratio = devicePixelRatio || 1;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = "#1b1d21";
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.imageSmoothingEnabled = zoom < 3;
    if (frames.paint(frame)) pen.drawImage(frames.canvas, -left * zoom, -top * zoom, tracks.width * zoom, tracks.height * zoom);
    const lines = tracks.inFrame(frame), piece = selected === null ? -1 : tracks.piece[selected];
    for (const s of lines) if (s !== selected) this.line(s, ratio, tracks.piece[s] === piece, s === anchor);
    if (selected !== null && tracks.frame[selected] === frame) this.line(selected, ratio, true, selected === anchor);
    pen.font = `600 ${12 * ratio}px system-ui, sans-serif`;
    for (const s of lines) if (tracks.whisker[s] >= 0 && this.labelled(s, lines)) this.label(s, ratio);
  }

  labelled(s, lines) { // of the pieces of a broken whisker the longest one
    const { tracks } = this;
    return lines.every(o => tracks.whisker[o] !== tracks.whisker[s] || tracks.size(o) < tracks.size(s) || (tracks.size(o) === tracks.size(s) && o >= s));
  }

  path(s) {
    const { pen, tracks, zoom, left, top } = this, [a, b] = tracks.points(s);
    pen.beginPath();
    for (let i = a; i < b; i++) pen.lineTo((tracks.column[i] + 0.5 - left) * zoom, (tracks.row[i] + 0.5 - top) * zoom);
  }

  line(s, ratio, chosen, anchored) {
    const { pen, tracks } = this, k = tracks.whisker[s];
    this.path(s);
    pen.lineJoin = pen.lineCap = "round";
    if (chosen || anchored) {
      pen.strokeStyle = "#000"; pen.lineWidth = 9 * ratio; pen.stroke();
      pen.strokeStyle = anchored ? "#ffe14d" : "#fff"; pen.lineWidth = 6.5 * ratio; pen.stroke();
    }
    if (!chosen && !anchored && k !== -2) { // seen on light and on dark
      pen.strokeStyle = "#000"; pen.globalAlpha = 0.45; pen.lineWidth = (k >= 0 ? 3.6 : 3) * ratio; pen.stroke();
    }
    pen.strokeStyle = colour(k);
    pen.lineWidth = (k >= 0 ? 2 : 1.5) * ratio;
    pen.globalAlpha = k === -2 ? 0.35 : k >= 0 ? 0.95 : 0.9;
    pen.setLineDash(k === -2 ? [3 * ratio, 4 * ratio] : this.tracks.other[s] >= 0 ? [7 * ratio, 4 * ratio] : []);
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  label(s, ratio) {
    const { pen, tracks, zoom, left, top, canvas } = this, [a, b] = tracks.points(s), c = Math.max(a, b - 4);
    const dx = tracks.column[b - 1] - tracks.column[c], dy = tracks.row[b - 1] - tracks.row[c], way = Math.hypot(dx, dy) || 1;
    const x = (tracks.column[b - 1] + 0.5 - left) * zoom + 10 * ratio * dx / way, y = (tracks.row[b - 1] + 0.5 - top) * zoom + 10 * ratio * dy / way;
    const text = tracks.name(tracks.whisker[s]), edge = 9 * ratio;
    pen.textAlign = "center"; pen.textBaseline = "middle";
    pen.lineWidth = 3.5 * ratio; pen.strokeStyle = "#000"; pen.lineJoin = "round";
    const at = [Math.min(Math.max(x, edge), canvas.width - edge), Math.min(Math.max(y, edge), canvas.height - edge)];
    pen.strokeText(text, ...at);
    pen.fillStyle = colour(tracks.whisker[s]);
    pen.fillText(text, ...at);
  }
}
