// The displacement 5 mm from the base as sound: at true pitch, or whole octaves up or down (and so much faster or slower).

let context = null, source = null;

export function sourceIn(audio, samples, rate, octave, loop) {
  let loudest = 0;
  for (const v of samples) loudest = Math.max(loudest, Math.abs(v));
  const buffer = audio.createBuffer(1, samples.length, rate);
  buffer.copyToChannel(samples.map(v => loudest ? 0.5 * v / loudest : 0), 0);
  const made = audio.createBufferSource();
  made.buffer = buffer;
  made.loop = loop;
  made.playbackRate.value = 2 ** octave;
  made.connect(audio.destination);
  return made;
}

export function stop() {
  source?.stop();
  source = null;
}

export async function play(samples, rate, octave, loop, ended) {
  stop();
  context ??= new AudioContext();
  await context.resume();
  source = sourceIn(context, samples, rate, octave, loop);
  const mine = source;
  mine.onended = () => { if (source === mine) source = null; ended(mine); };
  mine.start();
  return mine;
}

export async function rendered(samples, rate, octave, seconds, at = 44100) { // what would be heard, for tests
  const audio = new OfflineAudioContext(1, Math.round(seconds * at), at);
  sourceIn(audio, samples, rate, octave, false).start();
  return (await audio.startRendering()).getChannelData(0);
}
