// Controls made from the one table; the state is what differs from its defaults, in SI, and is in the address.

export const LONGEST_ADDRESS = 8000;
const OPEN = ["Posture", "Scan", "Texture A"];

export function stateFrom(address) {
  const state = new Map(), text = address.replace(/^#/, "");
  if (text.length > LONGEST_ADDRESS) throw new Error(`the address must have at most ${LONGEST_ADDRESS} characters behind its #, got ${text.length}; the page starts from its defaults`);
  for (const [name, value] of new URLSearchParams(text)) state.set(name, value);
  return state;
}

export function addressOf(state, table) {
  const changed = [...state].filter(([name, value]) => !(name in table) || String(value) !== String(table[name].default));
  return `#${changed.length ? new URLSearchParams(changed) : `hold=${table.hold.default}`}`; // an empty one is the first preset
}

export function nameOf(letter, value) { // what a texture is, in a few words
  const kind = value(`${letter}.kind`), um = name => `${rounded(1e6 * value(`${letter}.${name}`))} µm`;
  if (kind === "rough") return `roughness of ${um("rms")}`;
  if (kind === "wave") return `wave of ${um("amplitude")}`;
  if (kind === "periodic") return `grating, a gap each ${rounded(1e3 * value(`${letter}.period`))} mm`;
  return kind === "file" ? "dropped file" : `random grating, seed ${value(`${letter}.seed`)}`;
}

const tag = (name, set = {}, ...inside) => {
  const made = Object.assign(document.createElement(name), set);
  made.append(...inside);
  return made;
};

const rounded = x => Number(x.toPrecision(8));
const logarithmic = one => one.low > 0 && one.high / one.low >= 50;
const toSlider = (one, value) => logarithmic(one) ? Math.log(value / one.low) / Math.log(one.high / one.low) * 1000 : value / one.step;
const fromSlider = (one, at) => rounded(logarithmic(one) ? Number((one.low * (one.high / one.low) ** (at / 1000)).toPrecision(4)) : at * one.step);

function numberControl(name, one, changed) {
  const unit = one.unit ? ` [${one.unit}]` : "", id = `c-${name}`;
  const label = tag("label", { htmlFor: id, textContent: one.label + unit });
  const field = tag("input", { type: "number", id, step: "any", inputMode: "decimal" });
  const parts = [label, field];
  field.addEventListener("input", () => changed(name, field.value === "" ? "" : rounded(Number(field.value) / one.scale)));
  let slider = null;
  if (!one.whole) {
    const log = logarithmic(one);
    slider = tag("input", { type: "range", id: `${id}-slider`, min: log ? 0 : one.low / one.step, max: log ? 1000 : one.high / one.step, step: 1 });
    slider.setAttribute("aria-label", one.label + unit);
    slider.addEventListener("input", () => changed(name, fromSlider(one, slider.valueAsNumber)));
    parts.push(slider);
  } else field.step = "1";
  const typed = () => field.value === "" ? NaN : rounded(Number(field.value) / one.scale);
  const show = value => { // what already says so is left alone: someone may be typing or dragging there
    const number = value === "" ? NaN : Number(value), known = Number.isFinite(number), text = known ? String(rounded(number * one.scale)) : "";
    if (!Object.is(typed(), number)) field.value = text;
    if (!slider) return;
    if (known && fromSlider(one, slider.valueAsNumber) !== number) slider.value = toSlider(one, number);
    slider.setAttribute("aria-valuetext", `${text} ${one.unit}`);
  };
  return { parts, show };
}

function choiceControl(name, one, changed) {
  const id = `c-${name}`, field = tag("select", { id }, ...Object.entries(one.choices).map(([value, text]) => tag("option", { value, textContent: text })));
  field.addEventListener("change", () => changed(name, field.value));
  return { parts: [tag("label", { htmlFor: id, textContent: one.label }), field], show: value => { field.value = value; } };
}

const UNITS = ["", "m", "mm", "um", "nm"];

function fileControl(name, one, dropped) {
  const id = `c-${name}`, letter = name[0], field = tag("input", { type: "file", id });
  const select = (key, text, values) => tag("label", { textContent: `${text} ` }, tag("select", { name: key }, ...values.map(v => tag("option", { value: v, textContent: v || "as in the file" }))));
  const tick = (key, text) => tag("label", {}, tag("input", { type: "checkbox", name: key }), ` ${text}`);
  const line = tag("label", { textContent: "line of a map " }, tag("input", { name: "line", size: 6, placeholder: "x:12" }));
  const open = tag("div", { className: "open" }, select("x_unit", "x in", UNITS), select("z_unit", "z in", UNITS), select("level", "tilt", ["", "line", "none"]), tick("fill", "fill holes"), tick("flip", "flip"), line);
  const note = tag("div", { className: "open pale" });
  let last = null;
  const again = () => last && dropped(letter, last, settled(open)).then(notes => note.replaceChildren(...notes.map(n => tag("span", { textContent: n }))));
  field.addEventListener("change", () => { last = field.files[0]; again(); });
  open.addEventListener("change", again);
  const control = { shown: undefined, waiting: false };
  const reveal = line => { // what the file leaves open is settled beside it
    control.waiting = true;
    control.row.hidden = false;
    control.row.closest("details").open = true;
    const key = /unit/.test(line) ? (/\bz|height/.test(line) ? "z_unit" : "x_unit") : /map|line/.test(line) ? "line" : null;
    control.row.scrollIntoView({ block: "nearest" });
    if (key) open.querySelector(`[name=${key}]`).focus({ preventScroll: true });
  };
  return Object.assign(control, { reveal, parts: [tag("label", { htmlFor: id, textContent: "CSV or profilometer file (or drop it on the page)" }), field, open, note], show: () => {}, take: file => { last = file; return again(); } });
}

const settled = open => Object.fromEntries([...open.querySelectorAll("[name]")].map(e => [e.name, e.type === "checkbox" ? (e.checked ? "1" : "") : e.value.trim()]).filter(([, v]) => v));

export function build(form, table, { changed, dropped }) {
  const made = {}, groups = {};
  for (const [name, one] of Object.entries(table)) {
    const group = groups[one.group] ??= form.appendChild(tag("details", { open: OPEN.includes(one.group) }, tag("summary", { textContent: one.group })));
    const kind = Object.keys(one.choices).length ? choiceControl : typeof one.default === "string" ? fileControl : numberControl;
    made[name] = kind(name, one, kind === fileControl ? dropped : changed);
    made[name].parts[0].title = one.about;
    made[name].row = group.appendChild(tag("div", { className: "control" }, ...made[name].parts));
  }
  form.addEventListener("submit", event => event.preventDefault());
  return made;
}

export function show(made, table, state) {
  const value = name => state.get(name) ?? table[name].default;
  for (const [name, control] of Object.entries(made)) {
    if (control.shown !== value(name)) control.show(control.shown = value(name));
    const hidden = !control.waiting && !Object.entries(table[name].only).every(([other, values]) => values.includes(String(value(other))));
    if (control.row.hidden !== hidden) control.row.hidden = hidden;
  }
}
