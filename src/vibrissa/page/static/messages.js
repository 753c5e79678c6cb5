// Binary messages of the server: length of a header, the header in JSON, arrays of 32-bit floats.

export function unpacked(message) {
  const length = new DataView(message).getUint32(0, true), facts = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length)));
  let place = 4 + length;
  const shape = Object.fromEntries(facts.arrays), out = { ...facts, shape };
  for (const [name, size] of facts.arrays) {
    const n = size.reduce((a, b) => a * b, 1);
    out[name] = new Float32Array(message, place, n);
    place += 4 * n;
  }
  return out;
}
