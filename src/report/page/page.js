"use strict";
// The page: data out of the JSON element, the time under the cursor and the stretch of time that is shown, which all views share.
const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);

// value = low + (code - 1) * step in `bytes` bytes, little-endian; code 0 = none.
function unpack(packed) {
  const raw = atob(packed.data);
  const bytes = packed.bytes, count = raw.length / bytes, values = new Float64Array(count);
  for (let i = 0, at = 0; i < count; i++) {
    let code = 0, weight = 1;
    for (let b = 0; b < bytes; b++, at++) { code += raw.charCodeAt(at) * weight; weight *= 256; }
    values[i] = code === 0 ? NaN : packed.low + (code - 1) * packed.step;
  }
  return values;
}

const state = { from: data.start, to: data.end, cursor: null, views: [], marks: [] };

// Shows another stretch of time in all plots.
function show(from, to) {
  const least = Math.max((data.end - data.start) * 1e-7, 1e-7);
  if (!(to - from > least)) { const middle = (from + to) / 2; from = middle - least / 2; to = middle + least / 2; }
  const length = Math.min(to - from, data.end - data.start);
  from = Math.min(Math.max(from, data.start), data.end - length);
  state.from = from; state.to = from + length;
  for (const view of state.views) view();
}

// Moves the common cursor; null takes it away.
function point(time) {
  state.cursor = time;
  for (const mark of state.marks) mark(time);
}

// The run of a strip that holds at a time; -1 before the first.
function runAt(strip, time) {
  if (time > strip.end) return -1;
  let low = 0, high = strip.starts.length;
  while (low < high) { const middle = (low + high) >> 1; if (strip.starts[middle] <= time) low = middle + 1; else high = middle; }
  return low - 1;
}

function openStrip(strip) {
  if (!strip) return null;
  return { ...strip, starts: unpack(strip.starts), states: unpack(strip.states) };
}

const limits = openStrip(data.limits);
const lines = openStrip(data.lines);

// Digits that the distance of two neighbouring values deserves.
function shown(value, step) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  let digits = step > 0 ? Math.min(Math.max(Math.ceil(-Math.log10(step)), 0), 9) : 6;
  if (size > 0) digits = Math.min(digits, Math.max(0, 6 - Math.floor(Math.log10(size))));
  return value.toFixed(digits);
}

function style(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }
function dark() { return document.documentElement.dataset.theme === "dark"; }

// Colours that can be told apart on both grounds; also by those who see no red or green.
const PALETTE = { light: ["#0072b2", "#d55e00", "#009e73", "#b0569a", "#8a6d00", "#3d8fc9", "#7a4fb5", "#5f6b3a"], dark: ["#56b4e9", "#f0883e", "#3fc79a", "#e58fc8", "#e6c229", "#8fc7ff", "#b79cff", "#b5c27a"] };
const families = [];
for (const plot of data.plots) for (const curve of plot.curves) if (!families.includes(curve.family)) families.push(curve.family);
families.sort((a, b) => rank(a) - rank(b) || (a < b ? -1 : 1));
function rank(name) { const at = "XYZABCUVW".indexOf(name); return name.length === 1 && at >= 0 ? at : 99; }
function familyColour(family) { const list = PALETTE[dark() ? "dark" : "light"]; return list[Math.max(families.indexOf(family), 0) % list.length]; }
function limitColour(index) {
  const hue = (index * 137.5 + 205) % 360;
  return `hsl(${hue} ${dark() ? "60% 60%" : "62% 45%"})`;
}

// From little to much.
const RAMP = { light: [[68, 30, 120], [49, 90, 150], [30, 140, 140], [70, 180, 90], [205, 190, 30]], dark: [[110, 80, 190], [70, 130, 210], [50, 180, 180], [120, 215, 110], [245, 230, 70]] };
function rampColour(share) {
  const stops = RAMP[dark() ? "dark" : "light"], place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const i = Math.min(Math.floor(place), stops.length - 2), f = place - i;
  const mix = (k) => Math.round(stops[i][k] + f * (stops[i + 1][k] - stops[i][k]));
  return `rgb(${mix(0)},${mix(1)},${mix(2)})`;
}

// A canvas that is sharp on every screen; returns its context and size in CSS pixels.
function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  const width = Math.max(Math.round(box.width), 10), height = Math.max(Math.round(box.height), 10);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

function element(tag, className, text) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
}

// --- theme ---------------------------------------------------------------------------------------------------------------
const asked = window.matchMedia("(prefers-color-scheme: dark)");
document.documentElement.dataset.theme = asked.matches ? "dark" : "light";
const repaint = [];
function setTheme(name) { document.documentElement.dataset.theme = name; for (const paint of repaint) paint(); }
asked.addEventListener("change", (event) => setTheme(event.matches ? "dark" : "light"));
$("theme").addEventListener("click", () => setTheme(dark() ? "light" : "dark"));
$("reset").addEventListener("click", () => show(data.start, data.end));

// --- readout and program -------------------------------------------------------------------------------------------------
state.marks.push((time) => { $("readout").textContent = time === null ? "" : `t = ${time.toFixed(4)} s`; });

(function program() {
  const box = $("program"), list = $("programlines"), HEIGHT = 18;
  if (!data.programs.length) { $("programbox").hidden = true; return; }
  const texts = data.programs.map((p) => p.text.replace(/\r\n?/g, "\n").split("\n"));
  let current = 0, active = 0;
  function render() {
    const text = texts[current], first = Math.max(Math.floor(box.scrollTop / HEIGHT) - 10, 0);
    const last = Math.min(first + Math.ceil(box.clientHeight / HEIGHT) + 20, text.length);
    list.style.height = `${text.length * HEIGHT}px`;
    list.replaceChildren();
    for (let i = first; i < last; i++) {
      const row = element("div", i + 1 === active ? "nc active" : "nc");
      row.style.top = `${i * HEIGHT}px`;
      row.append(element("b", "", String(i + 1)), document.createTextNode(text[i]));
      list.append(row);
    }
  }
  function open(index) {
    current = index;
    $("programname").textContent = data.programs[index].name + (data.programs[index].cut ? " (only its beginning is in this page)" : "");
  }
  box.addEventListener("scroll", render);
  new ResizeObserver(render).observe(box);
  open(0);
  render();
  state.marks.push((time) => {
    const run = lines && time !== null ? runAt(lines, time) : -1;
    if (run < 0) { active = 0; $("programline").textContent = ""; render(); return; }
    const [name, line] = lines.names[lines.states[run]].split("\n");
    $("programline").textContent = `line ${line}`;
    const index = data.programs.findIndex((p) => p.name === name);
    if (index !== current && index >= 0) open(index);
    active = index < 0 && name ? 0 : Number(line);
    const top = (active - 1) * HEIGHT;
    if (top < box.scrollTop || top > box.scrollTop + box.clientHeight - 2 * HEIGHT) box.scrollTop = top - box.clientHeight / 2;
    render();
  });
  // A click on a line goes to where it is executed first.
  list.addEventListener("click", (event) => {
    const row = event.target.closest(".nc");
    if (!row || !lines) return;
    const line = row.firstChild.textContent, state_ = lines.names.indexOf(`${data.programs[current].name}\n${line}`);
    const run = state_ < 0 ? -1 : lines.states.indexOf(state_);
    if (run >= 0) point(lines.starts[run]);
  });
})();
