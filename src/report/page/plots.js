// Plots over time: uPlot with one common stretch of time and cursor. Every curve is drawn from its min/max pyramid: a column of the
// screen shows the smallest and the largest sample in it, so that no peak is hidden, however far one is zoomed out.

// Pyramid of a curve: level 0 as in the data, each further level of four of the one before.
function openCurve(curve) {
  const band = curve.kind === "band";
  const low = unpack(band ? curve.lo : curve.values), high = band ? unpack(curve.hi) : low;
  const levels = [{ low, high }];
  while (levels[levels.length - 1].low.length > 64) {
    const under = levels[levels.length - 1], count = Math.ceil(under.low.length / 4);
    const next = { low: new Float64Array(count).fill(NaN), high: new Float64Array(count).fill(NaN) };
    for (let i = 0; i < under.low.length; i++) {
      const at = i >> 2, a = under.low[i], b = under.high[i];
      if (a === a && !(next.low[at] <= a)) next.low[at] = a;
      if (b === b && !(next.high[at] >= b)) next.high[at] = b;
    }
    levels.push(next);
  }
  return { ...curve, band, levels, times: curve.times ? unpack(curve.times) : null, visible: curve.shown };
}

// Number of the first sample (or stretch) at or after a time, as a real number on a uniform grid.
function place(curve, time) {
  if (!curve.times) return (time - curve.start) / curve.width;
  let low = 0, high = curve.times.length;
  while (low < high) { const middle = (low + high) >> 1; if (curve.times[middle] < time) low = middle + 1; else high = middle; }
  if (low === 0 || low === curve.times.length) return low;
  const a = curve.times[low - 1], b = curve.times[low];
  return low - 1 + (time - a) / (b - a);
}

// Smallest and largest value of samples from..to (to not included), from the pyramid.
function extremes(curve, from, to) {
  let low = NaN, high = NaN;
  const take = (level, i) => {
    const a = curve.levels[level].low[i], b = curve.levels[level].high[i];
    if (a === a && !(low <= a)) low = a;
    if (b === b && !(high >= b)) high = b;
  };
  let level = 0;
  while (from < to) {
    if (level + 1 >= curve.levels.length || to - from < 8) { for (let i = from; i < to; i++) take(level, i); break; }
    while (from & 3 && from < to) take(level, from++);
    while (to & 3 && from < to) take(level, --to);
    from >>= 2; to >>= 2; level++;
  }
  return [low, high];
}

// Value of a curve at a time: [low, high]; between samples the straight line.
function valueAt(curve, time) {
  const { low, high } = curve.levels[0], p = place(curve, time);
  if (curve.band) { const i = Math.floor(p); return i >= 0 && i < low.length ? [low[i], high[i]] : [NaN, NaN]; }
  const n = low.length, near = Math.round(p);
  if (Math.abs(p - near) < 1e-6 && near >= 0 && near < n) return [low[near], low[near]];
  const i = Math.floor(p);
  if (i < 0 || i + 1 >= n) return [NaN, NaN];
  const value = low[i] + (p - i) * (low[i + 1] - low[i]);
  return [value, value];
}

// Lower and upper edge of a curve in each of the columns.
function columns(curve, times, width) {
  const n = times.length, low = new Array(n), high = new Array(n), count = curve.levels[0].low.length;
  for (let k = 0; k < n; k++) {
    const a = place(curve, times[k] - width / 2), b = place(curve, times[k] + width / 2);
    const offset = curve.band ? 0 : 0.999999;
    const from = Math.max(Math.floor(a + offset), 0), to = Math.min(curve.band ? Math.ceil(b) : Math.floor(b + 0.999999), count);
    let pair = from < to ? extremes(curve, from, to) : valueAt(curve, times[k]);
    if (pair[0] !== pair[0] && from < to && !curve.band) pair = [NaN, NaN];
    low[k] = pair[0] === pair[0] ? pair[0] : null;
    high[k] = pair[1] === pair[1] ? pair[1] : null;
  }
  return [low, high];
}

function makePlot(plot) {
  const panel = element("div", "panel plot"), bar = element("div", "bar"), area = element("div"), legend = element("div", "legend");
  bar.append(element("b", "", plot.title), element("span", "unit", pretty(plot.unit)));
  panel.append(bar, area, legend);
  $("plots").append(panel);
  const curves = plot.curves.map(openCurve);
  const height = 170;
  let chart = null, inside = false;

  const items = curves.map((curve) => {
    const button = element("button"), swatch = element("span", curve.dashed ? "swatch dashed" : "swatch"), value = element("span", "value");
    button.append(swatch, element("span", "", curve.name), value);
    button.title = `${curve.samples} samples; ${curve.band ? `deepest level: smallest and largest of ${(curve.width * 1000).toPrecision(3)} ms` : "every sample is in the page"}; ${curve.step > 0 ? `step ${curve.step.toPrecision(2)} ${plot.unit}` : "the same value all the time"}`;
    button.addEventListener("click", () => { curve.visible = !curve.visible; build(); mark(state.cursor); });
    legend.append(button);
    return { button, swatch, value };
  });

  function table() {
    const width = Math.max(panel.clientWidth - 80, 100), count = Math.min(Math.max(Math.round(width), 100), 3000);
    const step = (state.to - state.from) / count, times = new Array(count + 1);
    for (let k = 0; k <= count; k++) times[k] = state.from + k * step;
    const out = [times];
    for (const curve of curves) if (curve.visible) out.push(...columns(curve, times, step));
    return out;
  }

  function build() {
    const series = [{}], bands = [];
    curves.forEach((curve, i) => {
      const colour = familyColour(curve.family);
      items[i].swatch.style.borderTopColor = colour;
      items[i].swatch.style.opacity = curve.reference ? 0.6 : 1;
      items[i].button.classList.toggle("off", !curve.visible);
      if (!curve.visible) return;
      const alpha = curve.reference ? "99" : "";
      const line = { stroke: colour + alpha, width: curve.dashed ? 1.2 : 1.5, dash: curve.dashed ? [5, 4] : undefined, points: { show: false }, spanGaps: false, pxAlign: 0 };
      series.push({ ...line }, { ...line });
      bands.push({ series: [series.length - 1, series.length - 2], fill: colour + "40" });
    });
    const axis = { stroke: style("--soft"), grid: { stroke: style("--grid"), width: 1 }, ticks: { stroke: style("--line"), width: 1 }, font: "11px system-ui, sans-serif" };
    const options = {
      width: Math.max(panel.clientWidth - 2, 100), height, series, bands, legend: { show: false }, padding: [8, 14, 0, 0],
      scales: { x: { time: false, range: () => [state.from, state.to] }, y: { range: (u, low, high) => pad(low, high) } },
      axes: [{ ...axis, size: 28, values: (u, ticks) => ticks.map((t, i) => String(+t.toFixed(9)) + (i === ticks.length - 1 ? " s" : "")) }, { ...axis, size: 62, values: (u, ticks) => ticks.map(short) }],
      cursor: { y: false, points: { show: false }, drag: { x: true, y: false, setScale: false }, bind: { dblclick: () => () => { show(data.start, data.end); return null; } } },
      hooks: {
        setCursor: [(u) => { if (inside) point(u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null); }],
        setSelect: [(u) => {
          if (u.select.width > 3) { show(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")); }
          u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        }],
      },
    };
    if (chart) chart.destroy();
    chart = new uPlot(options, table(), area);
    chart.over.addEventListener("mouseenter", () => { inside = true; });
    chart.over.addEventListener("mouseleave", () => { inside = false; point(null); });
    chart.over.addEventListener("wheel", (event) => {
      event.preventDefault();
      const at = chart.posToVal(event.offsetX, "x"), factor = Math.exp(Math.sign(event.deltaY) * 0.25);
      show(at - (at - state.from) * factor, at + (state.to - at) * factor);
    }, { passive: false });
  }

  function mark(time) {
    if (chart && !inside) {
      const left = time === null || time < state.from || time > state.to ? -10 : chart.valToPos(time, "x");
      chart.setCursor({ left, top: -10 }, false);
    }
    curves.forEach((curve, i) => {
      if (time === null || !curve.visible) { items[i].value.textContent = ""; return; }
      const [low, high] = valueAt(curve, time);
      items[i].value.textContent = low === high || low !== low ? shown(low, curve.step) : `${shown(low, curve.step)} … ${shown(high, curve.step)}`;
    });
  }

  const refresh = () => { if (chart) { chart.setData(table(), true); mark(state.cursor); } };
  build();
  state.views.push(refresh);
  state.marks.push(mark);
  repaint.push(build);
  new ResizeObserver(() => {
    const width = Math.max(panel.clientWidth - 2, 100);
    if (chart && Math.abs(chart.width - width) > 1) { chart.setSize({ width, height }); refresh(); }
  }).observe(panel);
}

function pad(low, high) {
  if (low === null || high === null || low !== low) return [0, 1];
  const margin = (high - low) * 0.06 || Math.abs(high) * 0.01 || 1e-6;
  return [low - margin, high + margin];
}

// Units as they are printed: mm/s².
function pretty(unit) { return unit.replace("^2", "²").replace("^3", "³"); }

function short(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e6 || size < 1e-4 ? value.toExponential(1) : String(+value.toFixed(8));
}

for (const plot of data.plots) makePlot(plot);

// --- strip of limits -----------------------------------------------------------------------------------------------------
(function strip() {
  if (!limits) { $("stripbox").hidden = true; return; }
  const canvas = $("strip"), order = limits.names.map((name, i) => i).sort((a, b) => limits.durations[b] - limits.durations[a]);
  const whole = limits.durations.reduce((a, b) => a + b, 0) || 1;
  const LEFT = 62, RIGHT = 14;
  function paint() {
    const { context, width, height } = prepare(canvas);
    const plotWidth = width - LEFT - RIGHT, at = (time) => LEFT + (time - state.from) / (state.to - state.from) * plotWidth;
    const first = Math.max(runAt(limits, state.from), 0);
    // One column of the screen shows the state that holds longest in it: thousands of runs do not flicker.
    let column = LEFT, held = new Map();
    const flush = (until) => {
      let best = -1, most = 0;
      for (const [name, length] of held) if (length > most) { most = length; best = name; }
      if (best >= 0) { context.fillStyle = limitColour(best); context.fillRect(column, 2, until - column, height - 4); }
      column = until; held = new Map();
    };
    for (let i = first; i < limits.starts.length && limits.starts[i] < state.to; i++) {
      const end = i + 1 < limits.starts.length ? limits.starts[i + 1] : limits.end;
      const a = Math.max(at(limits.starts[i]), LEFT), b = Math.min(at(end), LEFT + plotWidth);
      if (b - a >= 1) {
        if (held.size) flush(a);
        column = a; held = new Map([[limits.states[i], b - a]]); flush(b);
      } else {
        held.set(limits.states[i], (held.get(limits.states[i]) || 0) + b - a);
        if (b - column >= 1) flush(b);
      }
    }
    if (held.size) flush(LEFT + plotWidth);
    if (state.cursor !== null && state.cursor >= state.from && state.cursor <= state.to) {
      context.fillStyle = style("--ink"); context.fillRect(at(state.cursor) - 0.5, 0, 1, height);
    }
  }
  function legend() {
    $("striplegend").replaceChildren(...order.slice(0, 16).map((i) => {
      const item = element("span"), block = element("span", "block");
      block.style.background = limitColour(i);
      item.append(block, ` ${limits.names[i]} ${(100 * limits.durations[i] / whole).toFixed(1)} %`);
      return item;
    }));
  }
  canvas.addEventListener("mousemove", (event) => {
    const box = canvas.getBoundingClientRect(), share = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
    point(share >= 0 && share <= 1 ? state.from + share * (state.to - state.from) : null);
  });
  canvas.addEventListener("mouseleave", () => point(null));
  state.views.push(paint);
  state.marks.push((time) => {
    const run = time === null ? -1 : runAt(limits, time);
    $("stripstate").textContent = run < 0 ? "" : limits.names[limits.states[run]];
    paint();
  });
  repaint.push(() => { legend(); paint(); });
  new ResizeObserver(paint).observe(canvas);
  legend();
  paint();
})();

// What the page does not show.
(function honesty() {
  const words = [];
  const banded = data.plots.flatMap((plot) => plot.curves).filter((curve) => curve.kind === "band");
  if (banded.length) {
    const width = Math.max(...banded.map((curve) => curve.width));
    words.push(`${banded.length} curves are too long to be here sample by sample: their deepest level is a band from the smallest to the largest sample of ${(width * 1000).toPrecision(3)} ms. No peak is left out.`);
  } else {
    words.push("Every sample of every curve is in this page.");
  }
  if (data.left_out) words.push(`${data.left_out} curves have no room in this page.`);
  words.push("Values are rounded to steps; the legend says the step when you point at it.");
  if (data.path && data.path.count < data.path.samples) words.push(`The path shows ${data.path.count} of ${data.path.samples} points, those with the largest error included.`);
  for (const strip of [limits, lines]) if (strip && strip.thinned) words.push(`Of ${strip.runs} runs of ${strip === limits ? "limits" : "NC lines"} the longest of each ${((data.end - data.start) / strip.count * 1000).toPrecision(3)} ms are here.`);
  words.push("Drag in a plot to zoom, wheel to zoom at the cursor, double click for the whole time.");
  $("honesty").textContent = words.join(" ");
})();
