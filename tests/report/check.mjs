// Opens pages of the built program in headless Chromium and looks at them as a user does: no errors, no requests, numbers under the cursor.
//
// In: path of the built program, path of Chromium, a folder to work in. Out: one line a check; exit status 1 when one fails.
// The truth is the CSV export of the same recording. Speaks the DevTools protocol over pipes: nothing to install.
import { execFileSync, spawn } from "node:child_process";
import { mkdirSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [sollwert, chromium, work] = process.argv.slice(2);
rmSync(work, { recursive: true, force: true });
mkdirSync(work, { recursive: true });
let failed = 0;
function check(ok, text) { console.log(`${ok ? "ok    " : "FAILED"} ${text}`); if (!ok) failed++; }
const run = (...args) => execFileSync(sollwert, args, { cwd: work, stdio: ["ignore", "pipe", "pipe"] }).toString();

// --- the pages ---------------------------------------------------------------------------------------------------------------
const EVIL = `; </script><script>window.injected = 1</script><img src=x onerror="window.injected = 2"> \u2028 & <b>`;
const program = ["N10 G17 G90 G642 CTOL=0.02 F3000 FFWON", EVIL, 'N20 MSG("</script><script>window.injected = 3</script>")', "N30 G1 X30", "N40 Y30",
  "N50 G3 X10 Y10 I-20", "N60 G1 X0 Y0", "N70 G2 X0 Y0 I15", "N80 G3 X0 Y0 I15", "N90 M30", ""].join("\n");
writeFileSync(path.join(work, "page<&>.mpf"), program);
run("run", "page<&>.mpf", "-m", "spinner_mvc850", "-o", "a.mcap", "--report", "a.html");
run("run", "page<&>.mpf", "-m", "spinner_mvc850", "-o", "b.mcap", "--set", "axes.X.drive.velocity_feedforward=0.9");
run("compare", "a.mcap", "b.mcap", "-o", "compare.html");
run("export", "a.mcap", "-o", "a.csv");
const csv = readFileSync(path.join(work, "a.csv"), "utf8").trimEnd().split("\n").map((line) => line.split(","));
const column = (name) => { const at = csv[0].indexOf(name); return csv.slice(1).map((row) => row[at] === "" ? NaN : Number(row[at])); };
const times = column("time_s");
function truth(name, time) {
  const values = column(name);
  let i = times.findIndex((t) => t > time) - 1;
  if (i < 0) i = times.length - 2;
  const share = (time - times[i]) / (times[i + 1] - times[i]);
  return { low: Math.min(values[i], values[i + 1]), high: Math.max(values[i], values[i + 1]), linear: values[i] + share * (values[i + 1] - values[i]), held: values[i] };
}

// --- the browser -------------------------------------------------------------------------------------------------------------
const flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--remote-debugging-pipe", `--user-data-dir=${path.join(work, "profile")}`, "--window-size=1500,1000", "about:blank"];
const browser = spawn(chromium, flags, { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
const waiting = new Map(), listeners = [];
let number = 0, pending = "";
browser.stdio[4].on("data", (chunk) => {
  pending += chunk.toString("utf8");
  for (let end; (end = pending.indexOf("\0")) >= 0; pending = pending.slice(end + 1)) {
    const message = JSON.parse(pending.slice(0, end));
    if (message.id && waiting.has(message.id)) { const { resolve, reject } = waiting.get(message.id); waiting.delete(message.id); message.error ? reject(new Error(message.error.message)) : resolve(message.result); }
    else for (const listener of listeners) listener(message);
  }
});
browser.on("exit", (code) => { for (const { reject } of waiting.values()) reject(new Error(`the browser ended with ${code}`)); });
function send(method, params = {}, sessionId = undefined) {
  const id = ++number;
  browser.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + "\0");
  return new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
}
const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const guard = setTimeout(() => { console.log("FAILED no answer from the browser in 120 s"); browser.kill("SIGKILL"); process.exit(1); }, 120000);

async function open(file) {
  const { targetId } = await send("Target.createTarget", { url: "about:blank" });
  const { sessionId } = await send("Target.attachToTarget", { targetId, flatten: true });
  const call = (method, params) => send(method, params, sessionId);
  const page = { call, errors: [], requests: [] };
  listeners.push((message) => {
    if (message.sessionId !== sessionId) return;
    const p = message.params;
    if (message.method === "Runtime.exceptionThrown") page.errors.push(p.exceptionDetails.exception?.description || p.exceptionDetails.text);
    if (message.method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(p.type)) page.errors.push(p.args.map((a) => a.value || a.description).join(" "));
    if (message.method === "Log.entryAdded" && ["error", "warning"].includes(p.entry.level)) page.errors.push(p.entry.text);
    if (message.method === "Network.requestWillBeSent") page.requests.push(p.request.url);
  });
  for (const domain of ["Page", "Runtime", "Log", "Network"]) await call(`${domain}.enable`);
  await call("Emulation.setDeviceMetricsOverride", { width: 1500, height: 1000, deviceScaleFactor: 1, mobile: false });
  await call("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: "light" }] });
  page.url = pathToFileURL(path.join(work, file)).href;
  await call("Page.navigate", { url: page.url });
  page.evaluate = async (expression) => {
    const { result, exceptionDetails } = await call("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description || exceptionDetails.text}`);
    return result.value;
  };
  for (let i = 0; i < 200 && (await page.evaluate("document.documentElement?.dataset.ready")) !== "yes"; i++) await sleep(50);
  page.screenshot = async (name) => writeFileSync(path.join(work, name), Buffer.from((await call("Page.captureScreenshot", { format: "png" })).data, "base64"));
  page.mouse = (type, x, y, more = {}) => call("Input.dispatchMouseEvent", { type, x, y, ...more });
  return page;
}

// Middle of the drawing area of the plot with this title, scrolled into view.
const area = (title) => `(() => { const p = [...document.querySelectorAll(".plot")].find((p) => p.querySelector("b").textContent === ${JSON.stringify(title)}); p.scrollIntoView({ block: "center" }); const b = p.querySelector(".u-over").getBoundingClientRect(); return { x: b.left, y: b.top, width: b.width, height: b.height }; })()`;
const legend = (title) => `Object.fromEntries([...[...document.querySelectorAll(".plot")].find((p) => p.querySelector("b").textContent === ${JSON.stringify(title)}).querySelectorAll(".legend button")].map((b) => [b.children[1].textContent, b.children[2].textContent]))`;

try {
  const page = await open("a.html");
  check((await page.evaluate("document.documentElement.dataset.ready")) === "yes", "the page comes to its end");
  check((await page.evaluate("window.injected")) === undefined && (await page.evaluate("document.querySelectorAll('script').length")) === 3, "text of the program is text: no script and no element of it");
  check(await page.evaluate(`[...document.querySelectorAll(".nc")].some((row) => row.textContent.includes("onerror="))`), "the program is shown, its odd characters too");

  // Numbers under the cursor against the export.
  for (const [title, signals] of [["Position", ["X.position_actual_mm", "Y.position_setpoint_mm"]], ["Control deviation", ["X.control_deviation_mm"]], ["Feed", ["path.feed_mm_min"]]]) {
    for (const share of [0.31, 0.64]) {
      const box = await page.evaluate(area(title));
      await page.mouse("mouseMoved", box.x + box.width * share - 3, box.y + box.height / 2);
      await page.mouse("mouseMoved", box.x + box.width * share, box.y + box.height / 2);
      const time = await page.evaluate("state.cursor"), values = await page.evaluate(legend(title));
      const whole = await page.evaluate("[data.start, data.end]");
      const wanted = whole[0] + share * (whole[1] - whole[0]);
      check(Math.abs(time - wanted) < 3 * (whole[1] - whole[0]) / box.width, `${title}: the cursor is at ${time?.toFixed(4)} s, wanted ${wanted.toFixed(4)}`);
      for (const name of signals) {
        const step = await page.evaluate(`data.plots.flatMap((p) => p.curves).find((c) => c.name === ${JSON.stringify(name)}).step`);
        const shown = Number(values[name]), real = truth(name, time), tolerance = 1.1 * step + 1e-6 * Math.max(Math.abs(real.linear), 1e-3);
        check(Math.abs(shown - real.linear) <= tolerance, `${name} at ${time.toFixed(4)} s: ${shown}, the export has ${real.linear}`);
      }
      const line = await page.evaluate(`document.getElementById("programline").textContent`);
      check(line === `line ${truth("path.line", time).held}`, `active line: ${line}, the export has ${truth("path.line", time).held}`);
      const active = await page.evaluate(`document.querySelector(".nc.active b")?.textContent`);
      check(`line ${active}` === line, `the marked line of the program is ${active}`);
      check((await page.evaluate(`document.getElementById("stripstate").textContent`)) !== "", "the strip says what limits the feed");
    }
  }

  // No peak is hidden when zoomed out: the extremes of what is drawn are those of the export.
  const drawn = await page.evaluate(`(() => { const out = {}; for (const plot of data.plots) for (const raw of plot.curves) { const c = openCurve(raw), n = 300, w = (data.end - data.start) / n; const [lo, hi] = columns(c, Array.from({ length: n + 1 }, (_, k) => data.start + k * w), w); out[raw.name] = [Math.min(...lo.filter((v) => v !== null)), Math.max(...hi.filter((v) => v !== null)), raw.step]; } return out; })()`);
  for (const name of ["X.jerk_setpoint_mm_s3", "Y.acceleration_setpoint_mm_s2", "X.control_deviation_mm", "path.contour_error_mm"]) {
    const values = column(name).filter((v) => !Number.isNaN(v)), low = Math.min(...values), high = Math.max(...values), [a, b, step] = drawn[name];
    check(Math.abs(a - low) <= 2 * step && Math.abs(b - high) <= 2 * step, `${name}: drawn ${a} … ${b}, the export has ${low} … ${high}`);
  }

  // Zoom by dragging, and back.
  let box = await page.evaluate(area("Position"));
  const [x0, x1, y] = [box.x + box.width * 0.2, box.x + box.width * 0.5, box.y + box.height / 2];
  await page.mouse("mouseMoved", x0, y);
  await page.mouse("mousePressed", x0, y, { button: "left", buttons: 1, clickCount: 1 });
  await page.mouse("mouseMoved", (x0 + x1) / 2, y, { button: "left", buttons: 1 });
  await page.mouse("mouseMoved", x1, y, { button: "left", buttons: 1 });
  await page.mouse("mouseReleased", x1, y, { button: "left", clickCount: 1 });
  await sleep(50);
  const zoomed = await page.evaluate("[state.from, state.to, data.start, data.end]");
  const share = (t) => (t - zoomed[2]) / (zoomed[3] - zoomed[2]);
  check(Math.abs(share(zoomed[0]) - 0.2) < 0.02 && Math.abs(share(zoomed[1]) - 0.5) < 0.02, `zoomed to ${zoomed[0].toFixed(3)} … ${zoomed[1].toFixed(3)} s`);
  await page.screenshot("zoomed.png");
  await page.evaluate(`document.getElementById("reset").click()`);
  check((await page.evaluate("state.to - state.from - (data.end - data.start)")) === 0, "the button shows the whole time again");

  // The path is drawn, in every colour and view.
  const painted = `(() => { const c = document.getElementById("path"), copy = new OffscreenCanvas(c.width, c.height).getContext("2d", { willReadFrequently: true }); copy.drawImage(c, 0, 0); const d = copy.getImageData(0, 0, c.width, c.height).data; let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n; })()`;
  for (const view of ["3d", "xy", "zx", "yz"]) for (const colour of ["feed", "error", "limit"]) {
    await page.evaluate(`document.querySelector('#views [data-view="${view}"]').click(); (() => { const c = document.getElementById("colour"); c.value = "${colour}"; c.dispatchEvent(new Event("change")); })()`);
    const pixels = await page.evaluate(painted);
    check(pixels > 300, `path in ${view}, coloured by ${colour}: ${pixels} pixels`);
  }
  await page.mouse("mouseMoved", 750, 8);
  await page.evaluate(`window.scrollTo(0, 0); document.querySelector('[data-view="xy"]').click(); point((data.start + data.end) / 2)`);
  await page.screenshot("light.png");
  await page.evaluate(`document.getElementById("theme").click()`);
  check((await page.evaluate(`getComputedStyle(document.documentElement).backgroundColor`)) !== "rgb(255, 255, 255)", "dark is dark");
  await page.screenshot("dark.png");
  await page.evaluate("window.scrollTo(0, 1e6)");
  await page.screenshot("tables.png");

  const two = await open("compare.html");
  check((await two.evaluate("document.documentElement.dataset.ready")) === "yes", "the page of a comparison comes to its end");
  const text = await two.evaluate("document.getElementById('figures').innerText");
  for (const words of ["time offset", "Contour error", "X.control_deviation_mm", "Pairs"]) check(text.includes(words), `its tables have: ${words}`);
  await two.evaluate("point((data.start + data.end) / 2)");
  await two.screenshot("compare.png");

  for (const [name, opened] of [["a.html", page], ["compare.html", two]]) {
    check(opened.errors.length === 0, `${name}: no errors (${opened.errors.slice(0, 3).join("; ")})`);
    const foreign = opened.requests.filter((url) => url !== opened.url && !url.startsWith("data:"));
    check(foreign.length === 0, `${name}: no requests (${foreign.slice(0, 3).join("; ")})`);
    const size = statSync(path.join(work, name)).size;
    check(size < 3e6, `${name}: ${size} bytes`);
  }
} catch (error) {
  check(false, String(error.stack || error));
} finally {
  clearTimeout(guard);
  await Promise.race([send("Browser.close").catch(() => {}), sleep(2000)]);
  browser.kill();
}
console.log(failed ? `${failed} checks failed` : "the pages are as they should be");
process.exit(failed ? 1 : 0);
