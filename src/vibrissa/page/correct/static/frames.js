// Frames of the movie as images: a bounded number is kept, those about the one that is shown are fetched ahead.

const KEPT = 256 << 20; // bytes
const AHEAD = 12, BEHIND = 3;

export class Frames {
  constructor(width, height, count, wrong) {
    Object.assign(this, { width, height, count, wrong, kept: new Map(), asked: new Map(), last: 0, way: 1 });
    this.canvas = document.createElement("canvas");
    this.canvas.width = width;
    this.canvas.height = height;
    this.pen = this.canvas.getContext("2d", { alpha: false });
    this.image = this.pen.createImageData(width, height);
    this.words = new Uint32Array(this.image.data.buffer);
    this.shown = -1;
    this.most = Math.max(2 * (AHEAD + BEHIND), Math.floor(KEPT / (width * height)));
  }

  has(n) { return this.kept.has(n); }

  async fetched(n) {
    if (this.kept.has(n)) return this.kept.get(n);
    if (!this.asked.has(n)) {
      const coming = fetch(`frame/${n}`).then(async reply => {
        if (!reply.ok) throw new Error((await reply.json()).error);
        return new Uint8Array(await reply.arrayBuffer());
      }).then(levels => { this.keep(n, levels); return levels; }).finally(() => this.asked.delete(n));
      this.asked.set(n, coming);
    }
    return this.asked.get(n);
  }

  keep(n, levels) {
    this.kept.set(n, levels);
    for (const old of this.kept.keys()) {
      if (this.kept.size <= this.most) break;
      if (Math.abs(old - this.last) > AHEAD) this.kept.delete(old);
    }
  }

  paint(n) { // onto the canvas of the frame's own size; false if it is not here yet
    if (!this.kept.has(n)) return false;
    if (this.shown !== n) {
      const levels = this.kept.get(n), words = this.words;
      for (let i = 0; i < words.length; i++) words[i] = 0xff000000 | levels[i] * 0x10101;
      this.pen.putImageData(this.image, 0, 0);
      this.shown = n;
    }
    return true;
  }

  async show(n, then) { // then() once the frame can be painted, unless another one is wanted by then
    if (n !== this.last) this.way = n < this.last ? -1 : 1;
    this.last = n;
    try { await this.fetched(n); } catch (error) { this.wrong(error.message); return; }
    if (n === this.last) then();
    if (n !== this.last) return;
    for (let i = 1; i <= AHEAD; i++) this.prefetch(n + this.way * i);
    for (let i = 1; i <= BEHIND; i++) this.prefetch(n - this.way * i);
  }

  prefetch(n) {
    if (n >= 0 && n < this.count && !this.kept.has(n) && this.asked.size < 2 * AHEAD) this.fetched(n).catch(() => {}); // it is told when it is shown
  }
}
