// The page put together: what was found of the flights, the plots in their sections, time that passes.
"use strict";
const MARKS = { good: "✓", warn: "!", bad: "✗", unknown: "?" };
const letter = k => several ? `${"AB"[k] ?? k + 1}: ` : "";

// ---- what was found ----
function overview() {
  const body = by("flights");
  data.flights.forEach((flight, k) => {
    const group = element("div", { class: "overview" });
    if (several) group.append(element("h2", {}, swatch(colourOf(k)), letter(k) + flight.name));
    const card = element("div", { class: "card" }, table(flight.summary.map(([name, value]) => [element("th", {}, name), element("td", {}, value)])));
    for (const note of flight.notes) card.append(element("p", { class: "remark" }, note));
    group.append(card, verdictCard(flight));
    if (flight.checks.length) group.append(checkCard(flight));
    group.append(parameterCard(flight));
    body.append(group);
  });
}
function swatch(colour) { return element("i", { class: "swatch", style: `background:${colour}` }); }
function table(rows, head) {
  const made = element("table");
  if (head) made.append(element("thead", {}, element("tr", {}, ...head.map(h => element("th", {}, h)))));
  made.append(element("tbody", {}, ...rows.map(cells => element("tr", {}, ...cells))));
  return made;
}
function verdictCard(flight) {
  const list = element("ul", { class: "verdicts" });
  for (const v of flight.verdicts)
    list.append(element("li", { class: v.level }, element("span", { class: "mark", "aria-label": v.level }, MARKS[v.level]), element("span", {}, v.title), element("span", {}, v.text)));
  return element("div", { class: "card" }, list);
}
function checkCard(flight) {
  const rows = flight.checks.map(c => {
    const verdict = element("td", { class: c.passed === false ? "fail" : c.passed ? "pass" : "" }, c.passed === false ? "✗ failed" : c.passed ? "✓ passed" : "–");
    const when = element("td", { class: "num" });
    if (c.worst !== null) when.append(element("button", { onclick: () => setCursor(c.worst) }, clockText(c.worst)));
    return [element("td", {}, c.name), verdict, element("td", { class: "num" }, c.margin === null ? "–" : `${numberText(c.margin, Math.abs(c.margin) < 10 ? 2 : 1)} ${c.unit}`), when, element("td", {}, c.asked), element("td", {}, c.happened)];
  });
  const failed = flight.checks.filter(c => c.passed === false).length;
  return element("div", { class: "card wide", id: "checks" }, element("h2", {}, failed ? `Checks: ${failed} of ${flight.checks.length} failed` : `Checks: all ${flight.checks.length} passed`),
    element("div", { class: "scroll" }, table(rows, ["check", "", "margin", "worst at", "asked", "happened"])));
}
function parameterCard(flight) {
  if (!flight.has_defaults && !flight.parameters.length)
    return element("div", { class: "card wide" }, element("span", { class: "missing" }, "default values of parameters"));
  const rows = flight.parameters.map(([name, value, usual]) => [element("td", {}, name), element("td", { class: "num" }, String(+value.toPrecision(7))), element("td", { class: "num" }, String(+usual.toPrecision(7)))]);
  const details = element("details", {}, element("summary", {}, rows.length === 1 ? "One parameter differs from its default" : `${rows.length || "No"} parameters differ from their defaults`));
  if (rows.length) details.append(element("div", { class: "scroll" }, table(rows, ["parameter", "value", "default"])));
  return element("div", { class: "card wide" }, details);
}

// ---- modes and texts ----
function timelines() {
  const body = by("timeline-body");
  data.flights.forEach((flight, k) => {
    const bands = [["Mode", flight.modes, modeColour], ["State", [...flight.armed, ...flight.airborne], name => colourOf(name === "armed" ? 3 : 2)]].filter(([, spans]) => spans.length);
    if (flight.failsafe.length) bands.push(["Failsafe", flight.failsafe, () => palette.bad]);
    const figure = element("figure", { "data-panel": "timeline" }, element("figcaption", {}, several ? swatch(colourOf(k)) : "", letter(k) + (several ? flight.name : "What it did")));
    if (flight.missing.length) figure.append(element("p", { class: "missing", style: "padding:0 12px" }, flight.missing.join("; ")));
    const canvas = element("canvas", { style: `height:${MARGIN.top + 24 * Math.max(bands.length, 1) + 22 + MARGIN.bottom}px`, "aria-label": "Modes and texts against time" });
    addView(canvas, () => drawBands(canvas, bands, flight.texts));
    timeGestures(canvas, () => ({ left: MARGIN.left, width: canvas.clientWidth - MARGIN.left - MARGIN.right }));
    figure.append(canvas, textList(flight));
    body.append(figure);
  });
}
function drawBands(canvas, bands, texts) {
  const { g, width, height } = fitted(canvas), w = width - MARGIN.left - MARGIN.right;
  const x = t => MARGIN.left + (t - shown.from) / (shown.to - shown.from) * w;
  drawTimeAxis(g, x, width, height, MARGIN);
  g.save(); g.beginPath(); g.rect(MARGIN.left, 0, w, height); g.clip();
  bands.forEach(([, spans, colour], row) => {
    const top = MARGIN.top + 2 + 24 * row;
    for (const [name, from, to] of spans) {
      const isState = name === "in the air", a = x(from), b = x(to), left = Math.max(a, MARGIN.left);
      g.fillStyle = colour(name);
      g.globalAlpha = 0.28; g.fillRect(a, top + (isState ? 10 : 0), b - a, bands[row][0] === "State" ? 10 : 20);
      g.globalAlpha = 1; g.fillRect(a, top + (isState ? 10 : 0), Math.min(2, b - a), bands[row][0] === "State" ? 10 : 20);
      g.fillStyle = palette.ink; g.textAlign = "left"; g.textBaseline = "middle";
      if (bands[row][0] !== "State" && Math.min(b, width) - left > g.measureText(name).width + 10) g.fillText(name, left + 6, top + 10.5);
    }
  });
  const base = MARGIN.top + 24 * Math.max(bands.length, 1) + 12;
  for (const [t, level] of texts) {
    if (t < shown.from || t > shown.to) continue;
    const isSerious = SERIOUS.has(level);
    g.fillStyle = isSerious ? palette.bad : palette.soft;
    g.beginPath();
    if (isSerious) { g.moveTo(x(t), base - 7); g.lineTo(x(t) + 6, base + 4); g.lineTo(x(t) - 6, base + 4); g.fill(); }
    else { g.arc(x(t), base, 3.5, 0, 7); g.fill(); }
  }
  g.restore();
  g.fillStyle = palette.soft; g.textAlign = "right"; g.textBaseline = "middle"; g.font = "11px system-ui, sans-serif";
  bands.forEach(([name], row) => {
    if (name !== "State") return g.fillText(name, MARGIN.left - 4, MARGIN.top + 12 + 24 * row);
    g.font = "10px system-ui, sans-serif"; g.fillText("armed", MARGIN.left - 4, MARGIN.top + 6 + 24 * row); g.fillText("in air", MARGIN.left - 4, MARGIN.top + 18 + 24 * row); g.font = "11px system-ui, sans-serif";
  });
  g.fillText("texts", MARGIN.left - 4, base);
  drawCursor(g, x, MARGIN.top, height - MARGIN.top - MARGIN.bottom);
}
const SERIOUS = new Set(["emergency", "alert", "critical", "error", "warning"]);
const textRows = [];
function textList(flight) {
  const list = element("ul", { class: "texts" });
  for (const [t, level, text] of flight.texts) {
    const row = element("button", { class: SERIOUS.has(level) ? "serious" : "", onclick: () => setCursor(t) }, element("span", { class: "soft" }, clockText(t)), element("span", { class: "soft" }, level), element("span", {}, text));
    textRows.push([t, row]);
    list.append(element("li", {}, row));
  }
  return list;
}

// ---- sections ----
const plots = [];
function sections() {
  const contents = by("contents"), link = (id, title) => contents.append(element("a", { href: "#" + id }, title));
  link("overview", "Overview"); if (by("checks")) link("checks", "Checks"); link("where", "Track"); link("timeline", "Modes");
  for (const section of data.sections) {
    const body = element("section", { id: section.key }, element("h2", {}, section.title));
    if (section.missing.length) body.append(element("p", { class: "missing" }, section.missing.join("; ")));
    if (section.remark) body.append(element("p", { class: "remark" }, section.remark));
    const grid = element("div", { class: "plots" });
    for (const panel of section.panels) { const plot = new TimePlot(panel); plots.push(plot); grid.append(plot.figure); }
    if (section.key === "vibration") spectra(body, grid);
    body.append(grid);
    by("sections").append(body);
    link(section.key, section.title);
  }
}
function spectra(body, grid) {
  if (data.spectra_missing.length) body.append(element("p", { class: "missing" }, data.spectra_missing.join("; ")));
  for (const key of new Set(data.spectra.map(s => s.key))) grid.append(new SpectrumPlot(key).figure);
  for (const w of data.waterfalls) grid.append(new Waterfall(w).figure);
}

// ---- where ----
function places() {
  if (!flown.length) {
    by("where").replaceChildren(element("h2", {}, "Track"), element("p", { class: "missing" }, "no position (topic vehicle_local_position or GNSS)"));
    return;
  }
  by("track-note").textContent = `north is up; from ${[...new Set(flown.map(t => t.source))].join(", ")}`;
  const map = new TrackMap(by("map"));
  let scene = null;
  try { scene = new FlightScene(by("scene")); }
  catch (error) { by("scene").closest("figure").replaceChildren(element("p", { class: "remark", style: "padding:12px" }, `No replay: this browser gives ${error.message}.`)); }
  const paint = () => {
    const items = tracks.map((t, k) => t && [swatch(colourOf(k)), several ? letter(k) + data.flights[k].name : "track"]).filter(Boolean);
    const marks = [["start", palette.good], ["end", palette.bad]].map(([name, colour]) => [element("i", { class: "swatch", style: `background:${colour};width:10px;border-radius:5px` }), name]);
    by("map-legend").replaceChildren(...[...items, ...marks].map(parts => element("span", {}, ...parts)));
    if (flown.some(t => t.home)) by("map-legend").append(element("span", {}, element("b", {}, "H"), " home"));
    if (flown.some(t => t.waypoints.length)) by("map-legend").append(element("span", {}, "①… places it was sent to"));
    if (!several && flown[0].setpoint.length) by("map-legend").append(element("span", {}, "dashed: setpoint"));
    by("scene-legend").replaceChildren(...items.map(parts => element("span", {}, ...parts.map(p => p.cloneNode ? p.cloneNode(true) : p))), element("span", {}, "grey: its place on the level of home"));
  };
  legends.push(paint); paint();
  for (const button of document.querySelectorAll("[data-map]"))
    button.onclick = () => button.dataset.map === "all" ? map.all() : map.zoom(button.dataset.map === "in" ? 1.4 : 1 / 1.4);
  for (const button of document.querySelectorAll("[data-scene]")) button.onclick = () => {
    if (!scene) return;
    if (button.dataset.scene !== "follow") return scene.zoom(button.dataset.scene === "in" ? 1 / 1.3 : 1.3);
    scene.follows = !scene.follows;
    button.setAttribute("aria-pressed", scene.follows);
    redraw();
  };
}

// ---- time passes ----
let isPlaying = false, wallMs = 0;
function showClock() {
  by("time").value = shown.cursor;
  by("clock").textContent = `${clockText(shown.cursor)} of ${clockText(whole[1])}`;
  for (const [t, row] of textRows) row.classList.toggle("past", t < shown.cursor - 5);
}
function pass(ms) {
  if (!isPlaying) return;
  setCursor(shown.cursor + Math.min(ms - wallMs, 200) * 1e-3 * by("pace").value);
  wallMs = ms;
  if (shown.cursor >= whole[1]) return play(false);
  requestAnimationFrame(pass);
}
function play(is) {
  isPlaying = is;
  by("play").textContent = is ? "Pause" : "Play";
  if (!is) return;
  if (shown.cursor >= whole[1]) setCursor(whole[0]);
  wallMs = performance.now();
  requestAnimationFrame(pass);
}
by("play").onclick = () => play(!isPlaying);
by("whole").onclick = () => showTime(...whole);
by("time").min = whole[0]; by("time").max = whole[1];
by("time").oninput = e => setCursor(+e.target.value);
addEventListener("keydown", e => {
  if (e.target.matches("input, select, button")) return;
  if (e.key === " ") { e.preventDefault(); play(!isPlaying); }
  if (e.key === "ArrowLeft" || e.key === "ArrowRight") setCursor(shown.cursor + (e.key === "ArrowLeft" ? -1 : 1) * (shown.to - shown.from) / 100);
});
overview();
places();
timelines();
sections();
redraw();
