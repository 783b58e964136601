// The path in 2D and 3D: where the tool should have been (thin), where it was with the error magnified (coloured), the place of the cursor.
(function path() {
  const source = data.path;
  if (!source || !source.count) { $("pathbox").hidden = true; return; }
  const canvas = $("path"), n = source.count;
  const [time, x, y, z, ex, ey, ez, feed] = ["time", "x", "y", "z", "ex", "ey", "ez", "feed"].map((key) => unpack(source[key]));
  const error = new Float64Array(n);
  for (let i = 0; i < n; i++) error[i] = Math.hypot(ex[i], ey[i], ez[i]);
  if (!source.judged) { $("magnify").parentElement.hidden = true; document.querySelector('#colour option[value="error"]').remove(); }
  if (!limits) { const option = document.querySelector('#colour option[value="limit"]'); if (option) option.remove(); }
  const range = (list) => { let low = Infinity, high = -Infinity; for (const v of list) if (v === v) { low = Math.min(low, v); high = Math.max(high, v); } return [low, high]; };
  const boxes = [range(x), range(y), range(z)], centre = boxes.map(([a, b]) => (a + b) / 2);
  const size = Math.max(...boxes.map(([a, b]) => b - a), 1e-6);
  const feedRange = [0, Math.max(range(feed)[1], 1e-9)], errorRange = [0, Math.max(range(error)[1], 1e-9)];
  const flat = boxes.map(([a, b]) => b - a < 1e-6 * size);
  const camera = { view: flat[2] ? "xy" : flat[1] ? "zx" : flat[0] ? "yz" : "3d", turn: -0.6, tilt: 1.0, zoom: 1, dx: 0, dy: 0 };

  function axes() {
    // Rows: right and up on the screen, in X, Y, Z.
    if (camera.view === "xy") return [[1, 0, 0], [0, 1, 0]];
    if (camera.view === "zx") return [[0, 0, 1], [1, 0, 0]];
    if (camera.view === "yz") return [[0, 1, 0], [0, 0, 1]];
    const c = Math.cos(camera.turn), s = Math.sin(camera.turn), ct = Math.cos(camera.tilt), st = Math.sin(camera.tilt);
    return [[c, s, 0], [-s * ct, c * ct, st]];
  }
  function fit(right, up, width, height) {
    const spread = (axis) => boxes.reduce((sum, [a, b], k) => sum + Math.abs(axis[k]) * (b - a), 0) || size;
    return camera.zoom * Math.min((width - 50) / spread(right), (height - 40) / spread(up));
  }
  function projector(width, height) {
    const [right, up] = axes(), scale = fit(right, up, width, height);
    return (px, py, pz) => {
      const a = px - centre[0], b = py - centre[1], c = pz - centre[2];
      return [width / 2 + camera.dx + scale * (a * right[0] + b * right[1] + c * right[2]), height / 2 + camera.dy - scale * (a * up[0] + b * up[1] + c * up[2])];
    };
  }
  const factor = () => source.judged ? Math.pow(10, Number($("magnify").value)) : 1;
  function bucket(i) {
    const kind = $("colour").value;
    if (kind === "limit") { const run = runAt(limits, time[i]); return run < 0 ? -1 : limits.states[run]; }
    const share = kind === "error" ? error[i] / errorRange[1] : feed[i] / feedRange[1];
    return Math.round(Math.min(Math.max(share, 0), 1) * 31);
  }
  const colourOf = (b) => $("colour").value === "limit" ? (b < 0 ? style("--soft") : limitColour(b)) : rampColour(b / 31);

  let screen = null;
  function paint() {
    const { context, width, height } = prepare(canvas), at = projector(width, height), f = factor();
    $("factor").textContent = f < 10 ? f.toFixed(1) : String(Math.round(f));
    for (const button of document.querySelectorAll("#views button")) button.classList.toggle("on", button.dataset.view === camera.view);
    screen = new Float32Array(2 * n);
    context.lineJoin = "round";
    context.strokeStyle = style("--soft"); context.globalAlpha = 0.6; context.lineWidth = 1; context.beginPath();
    for (let i = 0; i < n; i++) {
      const [px, py] = at(x[i], y[i], z[i]);
      screen[2 * i] = px; screen[2 * i + 1] = py;
      if (i) context.lineTo(px, py); else context.moveTo(px, py);
    }
    context.stroke(); context.globalAlpha = 1;
    // Pieces of one colour together: thousands of strokes are slow.
    const pieces = new Map();
    let last = at(x[0] + f * ex[0], y[0] + f * ey[0], z[0] + f * ez[0]);
    for (let i = 1; i < n; i++) {
      const next = at(x[i] + f * ex[i], y[i] + f * ey[i], z[i] + f * ez[i]), b = bucket(i);
      if (!pieces.has(b)) pieces.set(b, new Path2D());
      const piece = pieces.get(b);
      piece.moveTo(last[0], last[1]); piece.lineTo(next[0], next[1]);
      last = next;
    }
    context.lineWidth = 1.8; context.lineCap = "round";
    for (const [b, piece] of pieces) { context.strokeStyle = colourOf(b); context.stroke(piece); }
    triad(context, height);
    scaleBar(context, width, height, f);
    if (state.cursor !== null) dot(context, at, f);
  }
  function triad(context, height) {
    const [right, up] = axes(), ox = 26, oy = height - 22, length = 20;
    context.font = "11px system-ui, sans-serif"; context.lineWidth = 1.4;
    ["X", "Y", "Z"].forEach((name, k) => {
      const vx = right[k] * length, vy = -up[k] * length;
      if (Math.hypot(vx, vy) < 3) return;
      context.strokeStyle = context.fillStyle = style("--soft");
      context.beginPath(); context.moveTo(ox, oy); context.lineTo(ox + vx, oy + vy); context.stroke();
      context.fillText(name, ox + vx * 1.35 - 3, oy + vy * 1.35 + 4);
    });
  }
  function scaleBar(context, width, height, f) {
    const [right, up] = axes(), scale = fit(right, up, width, height);
    const round = (value) => { const p = Math.pow(10, Math.floor(Math.log10(value))); return value / p >= 5 ? 5 * p : value / p >= 2 ? 2 * p : p; };
    const length = round(90 / scale), px = length * scale;
    context.strokeStyle = context.fillStyle = style("--soft"); context.lineWidth = 1.4; context.textAlign = "right";
    context.beginPath(); context.moveTo(width - 12 - px, height - 14); context.lineTo(width - 12, height - 14); context.stroke();
    const micro = length / f * 1000;
    const errorText = source.judged ? ` path, ${micro >= 1 ? +micro.toPrecision(2) : micro.toPrecision(1)} µm error` : "";
    context.fillText(`${+length.toPrecision(2)} mm${errorText}`, width - 12, height - 20);
    context.textAlign = "left";
  }
  function indexAt(t) {
    let low = 0, high = n;
    while (low < high) { const middle = (low + high) >> 1; if (time[middle] < t) low = middle + 1; else high = middle; }
    return Math.min(low, n - 1);
  }
  function dot(context, at, f) {
    const i = indexAt(state.cursor);
    const [px, py] = at(x[i], y[i], z[i]), [qx, qy] = at(x[i] + f * ex[i], y[i] + f * ey[i], z[i] + f * ez[i]);
    context.strokeStyle = style("--ink"); context.lineWidth = 1; context.beginPath(); context.moveTo(px, py); context.lineTo(qx, qy); context.stroke();
    context.fillStyle = style("--accent"); context.beginPath(); context.arc(qx, qy, 5, 0, 7); context.fill();
    context.strokeStyle = style("--paper"); context.lineWidth = 1.5; context.stroke();
  }
  function legend() {
    const box = $("pathlegend"), kind = $("colour").value;
    box.replaceChildren();
    if (kind === "limit") {
      const order = limits.names.map((name, i) => i).sort((a, b) => limits.durations[b] - limits.durations[a]).slice(0, 12);
      box.append(...order.map((i) => { const item = element("span"), block = element("span", "block"); block.style.background = limitColour(i); item.append(block, ` ${limits.names[i]}`); return item; }));
    } else {
      const bar = element("span", "scale"), ramp = element("i"), stops = [0, 0.25, 0.5, 0.75, 1].map(rampColour).join(",");
      ramp.style.background = `linear-gradient(90deg, ${stops})`;
      const unit = kind === "error" ? "µm" : source.axes.length ? "mm/min" : "";
      const top = kind === "error" ? errorRange[1] * 1000 : feedRange[1];
      bar.append(`0`, ramp, `${+top.toPrecision(3)} ${unit}`);
      box.append(bar);
    }
    const where = element("span", "", source.judged ? `${source.against.replaceAll("_", " ")}${source.in_part ? ", tool tip in the part" : ""}` : source.stem.replaceAll("_", " "));
    where.style.color = "var(--soft)";
    box.append(where);
    const here = element("span", "value"); here.id = "pathvalue"; box.append(here);
  }
  function mark() {
    paint();
    const here = $("pathvalue");
    if (!here) return;
    if (state.cursor === null) { here.textContent = ""; return; }
    const i = indexAt(state.cursor);
    here.textContent = `${source.judged ? `error ${(error[i] * 1000).toFixed(2)} µm, ` : ""}feed ${feed[i].toFixed(0)} mm/min`;
  }

  let drag = null;
  canvas.addEventListener("pointerdown", (event) => { drag = { x: event.clientX, y: event.clientY, move: event.shiftKey || event.button !== 0 || camera.view !== "3d" }; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointerup", () => { drag = null; });
  canvas.addEventListener("pointermove", (event) => {
    if (drag) {
      const dx = event.clientX - drag.x, dy = event.clientY - drag.y;
      if (drag.move) { camera.dx += dx; camera.dy += dy; } else { camera.turn -= dx * 0.01; camera.tilt = Math.min(Math.max(camera.tilt - dy * 0.01, 0), Math.PI); }
      drag.x = event.clientX; drag.y = event.clientY;
      paint();
      return;
    }
    // The nearest place on the screen takes the cursor of all plots.
    const box = canvas.getBoundingClientRect(), mx = event.clientX - box.left, my = event.clientY - box.top;
    let best = -1, least = 400;
    for (let i = 0; screen && i < n; i++) { const d = (screen[2 * i] - mx) ** 2 + (screen[2 * i + 1] - my) ** 2; if (d < least) { least = d; best = i; } }
    if (best >= 0) point(time[best]);
  });
  canvas.addEventListener("pointerleave", () => { if (!drag) point(null); });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const box = canvas.getBoundingClientRect(), f = Math.exp(-Math.sign(event.deltaY) * 0.2);
    const mx = event.clientX - box.left - box.width / 2, my = event.clientY - box.top - box.height / 2;
    camera.dx = mx - (mx - camera.dx) * f; camera.dy = my - (my - camera.dy) * f; camera.zoom *= f;
    paint();
  }, { passive: false });
  canvas.addEventListener("dblclick", () => { camera.zoom = 1; camera.dx = camera.dy = 0; paint(); });
  for (const button of document.querySelectorAll("#views button")) button.addEventListener("click", () => { camera.view = button.dataset.view; camera.zoom = 1; camera.dx = camera.dy = 0; paint(); });
  $("colour").addEventListener("change", () => { legend(); paint(); });
  $("magnify").addEventListener("input", paint);
  state.marks.push(mark);
  repaint.push(() => { legend(); paint(); });
  new ResizeObserver(paint).observe(canvas);
  legend();
  paint();
})();
// Without path and program the plots have the whole width.
if ($("pathbox").hidden && $("programbox").hidden) { $("left").hidden = true; document.querySelector("main").classList.add("wide"); }
document.documentElement.dataset.ready = "yes";
