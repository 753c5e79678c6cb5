// What can be taken away: files of either texture, single pictures, and the state as address, command and Python.

const $ = id => document.getElementById(id);
const tag = (name, set) => Object.assign(document.createElement(name), set);
const FILES = ["picture.png", "picture.svg", "data.nc", "signals.csv", "sound.wav", "texture.csv", "study.zip"];
const COMPARED = ["cut-close", "free-close", "bridge-trace"]; // pictures of the whole whisker alone
const PICTURES = { whole: "Whisker", close: "Contact", excursion: "Excursion", modes: "Modes", "moment-view": "Moment at the base", spectrogram: "Spectrogram", resonance: "Resonance", firing: "Firing", contrast: "A or B", "cut-close": "Cut at the contact", "free-close": "With its free end", "bridge-trace": "Both in time" };
const COPIES = { "copy-command": "command.txt", "copy-python": "script.py" };
let query = "";

export function setQuery(text) { // the state behind the #
  query = text;
  link();
}

function link() {
  const rod = /(^|&)model=rod/.test(query);
  for (const one of $("picture").options) one.hidden = one.disabled = COMPARED.includes(one.value) && !rod;
  if (!rod && COMPARED.includes($("picture").value)) $("picture").value = "whole";
  for (const one of $("exports").children) one.hidden = one.textContent === "study.zip" && rod; // a study's movie has one contact
  for (const one of $("exports").children) one.href = `export/${$("letter").value}/${one.textContent}?${query}`;
}

export function keeping(current) { // current: what stands behind the # now
  $("exports").append(...FILES.map(name => tag("a", { textContent: name, href: "#" })));
  $("picture").append(...Object.entries(PICTURES).map(([value, textContent]) => tag("option", { value, textContent })));
  $("letter").onchange = link;
  $("save").onclick = save;
  $("copy-address").onclick = () => copied(`${location.href.split("#")[0]}#${current()}`);
  for (const [id, name] of Object.entries(COPIES)) $(id).onclick = () => taken(name, current());
}

async function taken(name, state) {
  const answer = await fetch(`export/${$("letter").value}/${name}?${state}`).catch(() => null);
  if (!answer?.ok) { $("copied").textContent = answer ? await answer.text() : "the page's program does not answer"; return; }
  const text = await answer.text();
  copied(text, text.includes("vibrissa-texture.csv") ? " It reads vibrissa-texture.csv: take texture.csv away into the same folder." : "");
}

async function copied(text, more = "") {
  $("snippet").textContent = text;
  $("snippet").hidden = false;
  const done = await navigator.clipboard.writeText(text).then(() => "Copied.", () => "The browser does not allow copying: select it below.");
  $("copied").textContent = done + more;
}

function save() { // the canvas on the colour of its card
  const from = $($("picture").value), sheet = tag("canvas", { width: from.width, height: from.height }), ctx = sheet.getContext("2d");
  ctx.fillStyle = getComputedStyle(from.closest("figure")).backgroundColor;
  ctx.fillRect(0, 0, sheet.width, sheet.height);
  ctx.drawImage(from, 0, 0);
  sheet.toBlob(blob => {
    const href = URL.createObjectURL(blob);
    tag("a", { href, download: `vibrissa-${from.id}.png` }).click();
    setTimeout(() => URL.revokeObjectURL(href), 1000);
  });
}
