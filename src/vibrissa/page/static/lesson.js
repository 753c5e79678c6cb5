// What the page teaches with: presets, a tour, the glossary, and the verdict on the model.

const $ = id => document.getElementById(id);
const tag = (name, set) => Object.assign(document.createElement(name), set);

const TOUR = [
  ["motion", "1 of 5. A whisker, held by the pad, touches a surface that moves to the left. Each edge holds its tip, bends it, and lets go."],
  ["modes-figure", "2 of 5. After each jump the whisker rings. It has several modes; the outer line, its envelope, is how strongly each rings."],
  ["firing-figure", "3 of 5. A neuron that fires above a threshold of the envelope turns the vibration into spikes."],
  ["contrast-figure", "4 of 5. Another surface gives another envelope, so one neuron tells them apart: listen to A and B at the top."],
  ["controls", "5 of 5. Move a slider, and every picture follows. The buttons at the top set states worth a look; Reset returns here."],
];
let step = -1;

export function presets(list, apply) {
  const press = one => { apply(one.state); stand(one); };
  const buttons = list.map(one => tag("button", { type: "button", textContent: one.name, title: one.about, onclick: () => press(one) }));
  const reset = tag("button", { type: "button", id: "reset", textContent: "Reset", title: "Back to the first state", onclick: () => press(list[0]) });
  const tour = tag("button", { type: "button", id: "tour-start", textContent: "Tour", title: "Five steps through the page", onclick: () => go(0) });
  for (const button of buttons) button.setAttribute("aria-pressed", "false");
  $("presets").append(tour, ...buttons, reset);
  $("tour-back").onclick = () => go(step - 1);
  $("tour-next").onclick = () => go(step + 1);
  $("tour-end").onclick = () => go(TOUR.length);
  $("tour").addEventListener("keydown", event => { if (event.key === "Escape") go(TOUR.length); });
}

// Say which preset the page shows, if any.
export function stand(one) {
  $("preset-about").textContent = one ? one.about : "";
  for (const button of $("presets").querySelectorAll("[aria-pressed]")) button.setAttribute("aria-pressed", String(button.textContent === one?.name));
}

function target(id) { return id.endsWith("-figure") ? $(id.slice(0, -7)).closest("figure") : $(id); }

function go(to) {
  if (step >= 0 && step < TOUR.length) target(TOUR[step][0]).classList.remove("shown");
  step = to;
  const on = step >= 0 && step < TOUR.length, last = step === TOUR.length - 1;
  const opened = on && $("tour").hidden;
  $("tour").hidden = !on;
  document.body.classList.toggle("touring", on);
  if (!on) { $("tour-start").focus(); return; }
  $("tour-text").textContent = TOUR[step][1];
  $("tour-back").disabled = step === 0;
  $("tour-next").textContent = last ? "Done" : "Next";
  target(TOUR[step][0]).classList.add("shown");
  target(TOUR[step][0]).scrollIntoView({ block: "center" });
  if (opened) $("tour").focus({ preventScroll: true });
}

export function glossary(symbols) {
  for (const one of document.querySelectorAll("abbr")) one.title = symbols[one.dataset.term ?? one.textContent];
  $("symbols").append(...Object.entries(symbols).flatMap(([name, text]) => [tag("dt", { textContent: name }), tag("dd", { textContent: text })]));
}

const VERDICTS = { usable: "The model holds here.", caution: "The model roughly holds here: read the caveats.", outside: "The model does not hold here: read why." };

export function unjudged() { // until the remarks on this state have come
  if (!$("verdict").dataset.level) return;
  delete $("verdict").dataset.level;
  $("verdict-line").textContent = "Does the model hold here?";
}

export function verdict(notes) {
  const level = Object.keys(VERDICTS).find(word => notes[0].startsWith(word));
  $("verdict").dataset.level = level;
  $("verdict-line").textContent = VERDICTS[level];
  $("notes").replaceChildren(...notes.map(text => tag("li", { textContent: text })));
}
