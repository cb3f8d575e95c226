// Vibration by frequency: spectra with logarithmic amplitudes, and waterfalls, whose horizontal axis is time.
"use strict";
class SpectrumPlot {
  constructor(key) {
    this.found = data.spectra.filter(s => s.key === key);
    const first = this.found[0], axes = ["x", "y", "z"];
    this.lines = this.found.flatMap(s => s.axes.map((a, k) => ({
      name: (several ? (s.flight ? "B " : "A ") : "") + axes[k], freq: arrays[s.freq], values: arrays[a], colour: () => colourOf(k), dash: s.flight ? [3, 2] : [], isHidden: false,
    })));
    this.canvas = element("canvas", { "aria-label": `${first.title} spectrum` });
    this.legend = element("div", { class: "legend" });
    this.figure = element("figure", { class: "plot", "data-panel": "spectrum_" + key },
      element("figcaption", {}, `${first.title} spectrum`, element("span", { class: "soft" }, ` [${first.unit} rms per bin], ${first.rate.toFixed(0)} samples/s of ${first.source}`)), this.legend, this.canvas);
    legends.push(() => this.paint());
    this.paint();
    this.pointed = null;
    const view = addView(this.canvas, () => this.draw());
    this.canvas.onpointermove = e => { this.pointed = e.offsetX; view.isStale = true; want(); };
    this.canvas.onpointerleave = () => { this.pointed = null; view.isStale = true; want(); };
  }
  paint() {
    this.legend.replaceChildren();
    for (const line of this.lines) {
      const button = element("button", { "aria-pressed": !line.isHidden });
      button.innerHTML = `<svg viewBox="0 0 20 8" aria-hidden="true"><line x1="0" y1="4" x2="20" y2="4" stroke="${line.colour()}" stroke-width="2" stroke-dasharray="${line.dash.join(" ")}"/></svg>`;
      line.told = element("b");
      button.append(line.name, line.told);
      button.onclick = () => { line.isHidden = !line.isHidden; this.paint(); redraw(); };
      this.legend.append(button);
    }
    this.at = element("b");
    this.legend.append(this.at);
  }
  draw() {
    const { g, width, height } = fitted(this.canvas), w = width - MARGIN.left - MARGIN.right, h = height - MARGIN.top - MARGIN.bottom;
    const seen = this.lines.filter(l => !l.isHidden), top = Math.max(...this.lines.map(l => l.freq[l.freq.length - 1]));
    let low = Infinity, high = 0;
    for (const l of seen) for (const v of l.values) if (v > 0) { low = Math.min(low, v); high = Math.max(high, v); }
    if (!(high > 0)) { low = 0.01; high = 1; }
    low = Math.max(low, high * 1e-4);
    const l0 = Math.floor(Math.log10(low)), l1 = Math.max(Math.ceil(Math.log10(high)), l0 + 1);
    const x = f => MARGIN.left + f / top * w, y = v => MARGIN.top + h - (Math.log10(Math.max(v, 1e-12)) - l0) / (l1 - l0) * h;
    g.strokeStyle = palette.grid; g.lineWidth = 1; g.fillStyle = palette.soft;
    g.textAlign = "right"; g.textBaseline = "middle";
    for (let e = l0; e <= l1; e++) {
      g.beginPath(); g.moveTo(MARGIN.left, y(10 ** e)); g.lineTo(width - MARGIN.right, y(10 ** e)); g.stroke();
      g.fillText(e < -3 || e > 3 ? `1e${e}`.replace("-", "−") : String(+(10 ** e).toPrecision(1)), MARGIN.left - 6, y(10 ** e));
    }
    const along = ticks(0, top, Math.max(2, w / 70));
    g.textBaseline = "top";
    for (const f of along.found) {
      g.beginPath(); g.moveTo(x(f), MARGIN.top); g.lineTo(x(f), MARGIN.top + h); g.stroke();
      g.textAlign = "center"; if (x(f) < width - 44) g.fillText(along.text(f), x(f), height - MARGIN.bottom + 6);
    }
    g.textAlign = "right"; g.fillText("Hz", width - MARGIN.right, height - MARGIN.bottom + 6);
    g.strokeStyle = palette.line; g.strokeRect(MARGIN.left, MARGIN.top, w, h);
    g.save(); g.beginPath(); g.rect(MARGIN.left, MARGIN.top, w, h); g.clip();
    for (const l of seen) {
      g.strokeStyle = l.colour(); g.lineWidth = 1.4; g.setLineDash(l.dash); g.beginPath();
      l.values.forEach((v, i) => { if (i) g.lineTo(x(l.freq[i]), y(v)); else g.moveTo(x(l.freq[i]), y(v)); });
      g.stroke();
    }
    g.restore(); g.setLineDash([]);
    const isPointed = this.pointed !== null && this.pointed >= MARGIN.left;
    const f = isPointed ? Math.min((this.pointed - MARGIN.left) / w, 1) * top : NaN;
    this.at.textContent = isPointed ? `at ${f.toFixed(1)} Hz` : "";
    for (const l of this.lines) l.told.textContent = isPointed ? l.values[Math.max(indexAt(l.freq, f), 0)].toPrecision(2) : "";
    if (isPointed) { g.strokeStyle = palette.soft; g.beginPath(); g.moveTo(x(f), MARGIN.top); g.lineTo(x(f), MARGIN.top + h); g.stroke(); }
  }
}

const RAMPS = {  // from least to most, dark on light and light on dark
  light: [[255, 255, 255], [205, 226, 246], [112, 168, 226], [38, 98, 178], [16, 36, 84]],
  dark: [[28, 32, 36], [24, 66, 116], [46, 122, 196], [138, 192, 240], [240, 248, 255]],
};
class Waterfall {
  constructor(w) {
    this.w = w;
    this.levels = array({ type: "u1", data: w.levels });
    this.canvas = element("canvas", { "aria-label": `${w.title} spectrum against time` });
    this.key = element("canvas", { width: 120, height: 10, style: "width:120px;height:10px" });
    const name = several ? ` ${w.flight ? "B" : "A"}` : "";
    this.figure = element("figure", { class: "plot", "data-panel": "waterfall_" + w.key },
      element("figcaption", {}, `${w.title} spectrum against time${name}`, element("span", { class: "soft" }, " [Hz], all axes")),
      element("div", { class: "legend" }, signed(`${w.db[0]} dB`), this.key, signed(`${w.db[1]} dB re 1 ${w.unit}`)), this.canvas);
    this.picture = document.createElement("canvas");
    this.paint();
    legends.push(() => this.paint());
    addView(this.canvas, () => this.draw());
    timeGestures(this.canvas, () => ({ left: MARGIN.left, width: this.canvas.clientWidth - MARGIN.left - MARGIN.right }));
  }
  paint() {
    const ramp = matchMedia("(prefers-color-scheme: dark)").matches ? RAMPS.dark : RAMPS.light, { columns, rows } = this.w;
    const colour = level => { const at = level / 255 * (ramp.length - 1), k = Math.min(Math.floor(at), ramp.length - 2); return ramp[k].map((v, c) => v + (at - k) * (ramp[k + 1][c] - v)); };
    const table = Array.from({ length: 256 }, (_, k) => colour(k));
    this.picture.width = columns; this.picture.height = rows;
    const g = this.picture.getContext("2d"), image = g.createImageData(columns, rows);
    for (let c = 0; c < columns; c++) for (let r = 0; r < rows; r++) {
      const at = 4 * ((rows - 1 - r) * columns + c);
      image.data.set(table[this.levels[c * rows + r]], at); image.data[at + 3] = 255;
    }
    g.putImageData(image, 0, 0);
    const k = this.key.getContext("2d"), bar = k.createImageData(120, 10);
    for (let x = 0; x < 120; x++) for (let y = 0; y < 10; y++) { const at = 4 * (y * 120 + x); bar.data.set(table[Math.round(x / 119 * 255)], at); bar.data[at + 3] = 255; }
    k.putImageData(bar, 0, 0);
  }
  draw() {
    const { g, width, height } = fitted(this.canvas), w = width - MARGIN.left - MARGIN.right, h = height - MARGIN.top - MARGIN.bottom;
    const x = t => MARGIN.left + (t - shown.from) / (shown.to - shown.from) * w, [from, to] = this.w.span;
    drawTimeAxis(g, x, width, height, MARGIN);
    g.save(); g.beginPath(); g.rect(MARGIN.left, MARGIN.top, w, h); g.clip();
    g.drawImage(this.picture, x(from), MARGIN.top, x(to) - x(from), h);
    g.restore();
    const top = this.w.freq[1], y = f => MARGIN.top + h - f / top * h, up = ticks(0, top, h / 34);
    g.textAlign = "right"; g.textBaseline = "middle"; g.fillStyle = palette.soft;
    for (const f of up.found) g.fillText(up.text(f), MARGIN.left - 6, y(f));
    g.strokeStyle = palette.line; g.strokeRect(MARGIN.left, MARGIN.top, w, h);
    drawCursor(g, x, MARGIN.top, h);
  }
}
