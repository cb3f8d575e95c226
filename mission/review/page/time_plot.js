// Plots against time: one canvas each, a legend above that shows the values at the cursor and hides curves.
"use strict";
const MARGIN = { left: 52, right: 10, top: 6, bottom: 30 };
const legends = [];
function paintLegends() { for (const paint of legends) paint(); }

class TimePlot {
  constructor(panel) {
    this.panel = panel;
    const names = [...new Set(panel.curves.filter(c => !c.setpoint).map(c => c.name))];
    const isByFlight = several && names.length <= 1;
    this.curves = panel.curves.map(c => ({
      ...c, times: arrays[c.t], values: arrays[c.v], isHidden: false,
      colour: () => isByFlight ? colourOf(c.flight) : c.setpoint ? palette.setpoint : colourOf(names.indexOf(c.name)),
      dash: c.setpoint ? [5, 3] : several && !isByFlight && c.flight ? [2, 2] : [],
      title: (several ? "AB"[c.flight] ? "AB"[c.flight] + " " : `${c.flight + 1} ` : "") + c.name,
    }));
    const measured = this.curves.filter(c => !c.setpoint), asked = this.curves.filter(c => c.setpoint);
    this.order = [...measured.reverse(), ...asked];  // the last is on top
    this.canvas = element("canvas", { "aria-label": `${panel.title}${panel.unit ? ` in ${panel.unit}` : ""} against time` });
    this.legend = element("div", { class: "legend" });
    const unit = element("span", { class: "soft" }, panel.unit ? ` [${panel.unit}]` : "");
    this.figure = element("figure", { class: "plot", "data-panel": panel.key }, element("figcaption", {}, panel.title, unit), this.legend, this.canvas);
    this.buildLegend();
    this.view = addView(this.canvas, () => this.draw());
    timeGestures(this.canvas, () => ({ left: MARGIN.left, width: this.canvas.clientWidth - MARGIN.left - MARGIN.right }));
  }
  buildLegend() {
    const paint = () => {
      this.legend.replaceChildren();
      for (const curve of this.curves) {
        if (!curve.name) continue;
        const line = `<svg viewBox="0 0 20 8" aria-hidden="true"><line x1="0" y1="4" x2="20" y2="4" stroke="${curve.colour()}" stroke-width="2" stroke-dasharray="${curve.dash.join(" ")}"/></svg>`;
        const button = element("button", { "aria-pressed": !curve.isHidden });
        button.innerHTML = line;
        curve.told = element("b");
        button.append(curve.title, curve.told);
        button.onclick = () => { curve.isHidden = !curve.isHidden; paint(); redraw(); };
        this.legend.append(button);
      }
      for (const [level, name] of this.panel.bounds) {
        const bound = element("span", { class: "bound" });
        bound.innerHTML = `<svg viewBox="0 0 20 8" aria-hidden="true"><line x1="0" y1="4" x2="20" y2="4" stroke="${palette.bad}" stroke-width="1.5" stroke-dasharray="2 3"/></svg>`;
        bound.append(`${name}: ${level}`);
        this.legend.append(bound);
      }
    };
    legends.push(paint);
    paint();
  }
  extremes(from, to) {
    let low = Infinity, high = -Infinity;
    for (const c of this.curves) {
      if (c.isHidden) continue;
      const end = Math.min(indexAt(c.times, to) + 2, c.times.length);
      for (let i = Math.max(indexAt(c.times, from), 0); i < end; i++) {
        const v = c.values[i];
        if (v < low) low = v;
        if (v > high) high = v;
      }
    }
    return [low, high];
  }
  range() {  // of what is shown
    let [low, high] = [Infinity, -Infinity];
    if (this.panel.of_flight && airborne[1] > airborne[0])
      [low, high] = this.extremes(Math.max(shown.from, airborne[0]), Math.min(shown.to, airborne[1]));
    if (!(low <= high)) [low, high] = this.extremes(shown.from, shown.to);
    if (!(low <= high)) { low = 0; high = 1; }
    if (this.panel.zero) low = Math.min(low, 0);
    if (this.panel.ceiling !== null) high = Math.min(high, this.panel.ceiling);
    const lack = Math.max(this.panel.least_span, 1e-6 * Math.abs(high), 1e-9) - (high - low);
    if (lack > 0) { if (this.panel.zero) high += lack; else { low -= lack / 2; high += lack / 2; } }
    const room = 0.05 * (high - low);
    return [this.panel.zero && low === 0 ? 0 : low - room, high + room];
  }
  draw() {
    const { g, width, height } = fitted(this.canvas), w = width - MARGIN.left - MARGIN.right, h = height - MARGIN.top - MARGIN.bottom;
    const [low, high] = this.range();
    const x = t => MARGIN.left + (t - shown.from) / (shown.to - shown.from) * w, y = v => MARGIN.top + h - (v - low) / (high - low) * h;
    this.scale = { x, y, low, high };
    drawModes(g, x, MARGIN.top, h);
    drawTimeAxis(g, x, width, height, MARGIN);
    g.textAlign = "right"; g.textBaseline = "middle"; g.strokeStyle = palette.grid; g.lineWidth = 1;
    const up = ticks(low, high, Math.max(3, h / 28));
    for (const v of up.found) {
      g.beginPath(); g.moveTo(MARGIN.left, y(v)); g.lineTo(width - MARGIN.right, y(v)); g.stroke();
      g.fillStyle = palette.soft; g.fillText(up.text(v), MARGIN.left - 6, y(v));
    }
    g.save();
    g.beginPath(); g.rect(MARGIN.left, MARGIN.top, w, h); g.clip();
    for (const [level] of this.panel.bounds) {
      if (level > high || level < low) continue;
      g.strokeStyle = palette.bad; g.setLineDash([2, 3]); g.beginPath(); g.moveTo(MARGIN.left, y(level)); g.lineTo(width - MARGIN.right, y(level)); g.stroke(); g.setLineDash([]);
    }
    for (const c of this.order) if (!c.isHidden) this.line(g, c, x, y);
    g.restore();
    drawCursor(g, x, MARGIN.top, h);
    for (const c of this.curves) if (c.told) {
      const i = indexAt(c.times, shown.cursor);
      c.told.textContent = i < 0 ? "–" : shortText(c.values[i], high - low);
    }
  }
  line(g, c, x, y) {
    const end = Math.min(indexAt(c.times, shown.to) + 2, c.times.length);
    const wraps = this.panel.wraps, begin = Math.max(indexAt(c.times, shown.from), 0), isDense = end - begin > 1.5 * this.canvas.clientWidth;
    g.strokeStyle = c.colour(); g.lineWidth = c.setpoint || isDense ? 1.1 : 1.6; g.setLineDash(c.dash);
    g.beginPath();
    let isDown = false, before = 0;
    for (let i = begin; i < end; i++) {
      const v = c.values[i];
      if (!Number.isFinite(v)) { isDown = false; continue; }
      const px = x(c.times[i]), py = y(v);
      if (!isDown || (wraps && Math.abs(v - c.values[i - 1]) > 180)) g.moveTo(px, py);
      else { if (c.step) g.lineTo(px, before); g.lineTo(px, py); }
      isDown = true; before = py;
    }
    g.stroke(); g.setLineDash([]);
  }
}
function shortText(v, span) {
  if (!Number.isFinite(v)) return "–";
  return numberText(v, Math.min(4, Math.max(0, 2 - Math.floor(Math.log10(Math.max(span, 1e-9))))));
}
function drawTimeAxis(g, x, width, height, margin) {
  const along = timeTicks(shown.from, shown.to, Math.max(2, (width - margin.left - margin.right) / 72)), bottom = height - margin.bottom;
  g.strokeStyle = palette.grid; g.lineWidth = 1; g.textBaseline = "top"; g.fillStyle = palette.soft;
  const unitWidth = g.measureText(along.unit).width;
  for (const t of along.found) {
    g.beginPath(); g.moveTo(x(t), margin.top); g.lineTo(x(t), bottom); g.stroke();
    g.textAlign = "center";
    const half = g.measureText(along.text(t)).width / 2, at = Math.min(Math.max(x(t), margin.left + half - 4), width - margin.right - half);
    if (at + half < width - margin.right - unitWidth - 8) g.fillText(along.text(t), at, bottom + 6);
  }
  g.textAlign = "right"; g.fillText(along.unit, width - margin.right, bottom + 6);
  g.strokeStyle = palette.line; g.strokeRect(margin.left, margin.top, width - margin.left - margin.right, bottom - margin.top);
}
function drawModes(g, x, top, h) {  // faint, behind the curves; of one flight only
  if (several) return;
  const left = x(shown.from), right = x(shown.to);
  g.globalAlpha = 0.09;
  for (const [name, from, to] of data.flights[0].modes) {
    const a = Math.max(x(from), left), b = Math.min(x(to), right);
    if (b > a) { g.fillStyle = modeColour(name); g.fillRect(a, top, b - a, h); }
  }
  g.globalAlpha = 0.16; g.fillStyle = palette.bad;
  for (const [, from, to] of data.flights[0].failsafe) {
    const a = Math.max(x(from), left), b = Math.min(x(to), right);
    if (b > a) g.fillRect(a, top, b - a, h);
  }
  g.globalAlpha = 1;
}
function drawCursor(g, x, top, h) {
  if (selection) {
    g.globalAlpha = 0.2; g.fillStyle = palette.accent; g.fillRect(x(selection[0]), top, x(selection[1]) - x(selection[0]), h); g.globalAlpha = 1;
  }
  if (shown.cursor < shown.from || shown.cursor > shown.to) return;
  g.strokeStyle = palette.soft; g.lineWidth = 1;
  g.beginPath(); g.moveTo(x(shown.cursor), top); g.lineTo(x(shown.cursor), top + h); g.stroke();
}
