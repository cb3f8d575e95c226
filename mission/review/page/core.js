// What all parts of the page share: the data, the stretch of time that is shown, the cursor, and when to draw.
"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const by = id => document.getElementById(id);
const arrays = data.arrays.map(text => array({ type: "f4", data: text }));
const several = data.flights.length > 1;

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "class") made.className = value;
    else if (key.startsWith("on")) made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

// ---- colours: the palette is the style sheet's ----
let palette = {};
function readPalette() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["page", "card", "ink", "soft", "line", "grid", "accent", "good", "warn", "bad", "sky", "ground", "setpoint"])
    palette[name] = style.getPropertyValue("--" + name).trim();
  palette.series = [1, 2, 3, 4, 5, 6, 7, 8].map(k => style.getPropertyValue("--c" + k).trim());
}
readPalette();
const colourOf = k => palette.series[k % palette.series.length];
const rgbOf = hex => [1, 3, 5].map(k => parseInt(hex.slice(k, k + 2), 16));
const MODE_HUES = {};  // a mode has one colour on the whole page
for (const flight of data.flights) for (const [name] of flight.modes) MODE_HUES[name] ??= Object.keys(MODE_HUES).length;
const modeColour = name => colourOf([0, 2, 3, 5, 4, 6, 7, 1][MODE_HUES[name] % 8]);

// ---- time ----
const LEAST_SPAN_S = 0.05;
const whole = [data.span[0], Math.max(data.span[1], data.span[0] + 1)];
const takeoff = Math.min(...data.flights.map(f => (f.airborne[0] ?? f.armed[0] ?? ["", 0])[1]));
const inAir = data.flights.flatMap(f => f.airborne), airborne = [Math.min(...inAir.map(s => s[1])), Math.max(...inAir.map(s => s[2]))];
const shown = { from: whole[0], to: whole[1], cursor: Math.max(takeoff, whole[0]) };
function showTime(from, to) {  // zooms all plots
  const span = Math.min(Math.max(to - from, LEAST_SPAN_S), whole[1] - whole[0]);
  from = Math.min(Math.max(from, whole[0]), whole[1] - span);
  shown.from = from; shown.to = from + span;
  by("whole").hidden = shown.from <= whole[0] && shown.to >= whole[1];
  redraw();
}
function setCursor(t) {
  shown.cursor = Math.min(Math.max(t, whole[0]), whole[1]);
  redraw();
}
function indexAt(times, t) {  // of the newest row, -1 before the first
  let low = -1, high = times.length - 1;
  while (low < high) { const mid = (low + high + 1) >> 1; if (times[mid] <= t) low = mid; else high = mid - 1; }
  return low;
}
const clockText = t => (t < 0 ? "−" : "") + (Math.abs(t) < 60 ? Math.abs(t).toFixed(1) + " s"
  : Math.floor(Math.abs(t) / 60) + ":" + (Math.abs(t) % 60).toFixed(1).padStart(4, "0"));

// ---- drawing: each view is drawn at the next frame, if it is on the screen ----
const views = [];
let isWanted = false;
function addView(canvas, draw) {
  const view = { canvas, draw, isStale: true, isNear: false };
  views.push(view);
  watcher.observe(canvas);
  return view;
}
const watcher = new IntersectionObserver(entries => {
  for (const entry of entries) for (const view of views) if (view.canvas === entry.target) view.isNear = entry.isIntersecting;
  want();
}, { rootMargin: "200px" });
function redraw() { for (const view of views) view.isStale = true; want(); }
function want() { if (!isWanted) { isWanted = true; requestAnimationFrame(drawNear); } }
function drawNear() {
  isWanted = false;
  for (const view of views) if (view.isStale && view.isNear) { view.isStale = false; view.draw(); }
  showClock();
}
addEventListener("resize", redraw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readPalette(); paintLegends(); redraw(); });

function fitted(canvas) {  // its context, in pixels of the page, cleared
  const ratio = Math.min(devicePixelRatio || 1, 3), width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0); g.clearRect(0, 0, width, height);
  g.font = "11.5px system-ui, sans-serif"; g.lineJoin = "round"; g.setLineDash([]);
  return { g, width, height };
}
function ticks(low, high, most) {  // round numbers, as many as there is room for
  const raw = (high - low) / Math.max(most, 1), power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].find(s => s * power >= raw * 0.999) * power;
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return { found, step, text: v => numberText(v, digits) };
}
const signed = text => String(text).replace("-", "−");
function numberText(v, digits) {
  if (!Number.isFinite(v)) return "–";
  if (Math.abs(v) >= 1e5 || digits > 4) return v === 0 ? "0" : v.toExponential(1).replace("e+", "e").replace("-", "−");
  return v.toFixed(digits).replace(/^-(0(\.0+)?)$/, "$1").replace("-", "−");
}
function timeTicks(from, to, most) {
  const span = to - from, steps = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600];
  const step = steps.find(s => span / s <= most) ?? span, found = [];
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to + 1e-9; k++) found.push(k * step);
  const digits = step < 0.1 ? 2 : step < 1 ? 1 : 0;
  const text = t => step >= 30 || Math.abs(to) >= 600 ? `${t < 0 ? "−" : ""}${Math.floor(Math.abs(t) / 60 + 1e-6)}:${String((Math.abs(t) - 60 * Math.floor(Math.abs(t) / 60 + 1e-6)).toFixed(digits)).padStart(digits ? digits + 3 : 2, "0")}` : numberText(t, digits);
  return { found, text, unit: step >= 30 || Math.abs(to) >= 600 ? "min:s" : "s" };
}

// ---- fingers and mouse on a drawing whose horizontal axis is time ----
function timeGestures(canvas, box) {  // box(): {left, width} of its axis
  const at = x => { const b = box(); return shown.from + (x - b.left) / b.width * (shown.to - shown.from); };
  const zoom = (x, factor) => { const t = at(x); showTime(t - (t - shown.from) * factor, t + (shown.to - t) * factor); };
  const fingers = new Map();
  let start = null;  // of a selection, by mouse
  canvas.onpointerdown = e => {
    fingers.set(e.pointerId, e.offsetX);
    if (e.pointerType === "mouse") { canvas.setPointerCapture(e.pointerId); start = e.offsetX; }
    setCursor(at(e.offsetX));
  };
  canvas.onpointermove = e => {
    if (e.pointerType === "mouse") {
      selection = start !== null && Math.abs(e.offsetX - start) > 6 ? [at(start), at(e.offsetX)].sort((a, b) => a - b) : null;
      return setCursor(at(e.offsetX));
    }
    if (!fingers.has(e.pointerId)) return;
    const before = [...fingers.values()];
    fingers.set(e.pointerId, e.offsetX);
    const after = [...fingers.values()];
    if (after.length === 1) return setCursor(at(e.offsetX));
    const b = box(), share = x => (x - b.left) / b.width;
    const was = Math.max(Math.abs(before[1] - before[0]), 10), is = Math.max(Math.abs(after[1] - after[0]), 10);
    const middle = at((before[0] + before[1]) / 2), span = (shown.to - shown.from) * was / is;
    const from = middle - share((after[0] + after[1]) / 2) * span;
    showTime(from, from + span);
  };
  const end = e => {
    fingers.delete(e.pointerId);
    if (start !== null && selection) showTime(...selection);
    start = selection = null;
    redraw();
  };
  canvas.onpointerup = end; canvas.onpointercancel = end;
  canvas.ondblclick = () => showTime(...whole);
  canvas.addEventListener("wheel", e => {
    if (e.ctrlKey || e.metaKey) { e.preventDefault(); zoom(e.offsetX, Math.exp(0.003 * e.deltaY)); }
    else if (e.shiftKey || Math.abs(e.deltaX) > Math.abs(e.deltaY)) {
      e.preventDefault();
      const along = (e.deltaX || e.deltaY) / box().width * (shown.to - shown.from);
      showTime(shown.from + along, shown.to + along);
    }
  }, { passive: false });
  canvas.addEventListener("touchstart", e => { if (e.touches.length > 1) e.preventDefault(); }, { passive: false });
}
let selection = null;  // a stretch of time that is about to be zoomed to
