// The track from above, in local metres: no tiles, so no network.
"use strict";
const tracks = data.tracks.map(t => t && {
  ...t, times: arrays[t.t], pos: arrays[t.pos], q: arrays[t.q], setpoint: arrays[t.setpoint],
});
const flown = tracks.filter(Boolean);

function stateAt(track, t) {  // where it was, and how it was turned
  const i = Math.max(indexAt(track.times, t), 0), j = Math.min(i + 1, track.times.length - 1);
  const gap = track.times[j] - track.times[i], share = gap > 0 ? Math.min(Math.max((t - track.times[i]) / gap, 0), 1) : 0;
  const mix = (name, width) => Array.from({ length: width }, (_, k) => {
    const a = track[name][width * i + k];
    return a + share * (track[name][width * j + k] - a);
  });
  let q = Array.from(track.q.slice(4 * i, 4 * i + 4));
  const b = track.q.slice(4 * j, 4 * j + 4), sign = q[0] * b[0] + q[1] * b[1] + q[2] * b[2] + q[3] * b[3] < 0 ? -1 : 1;
  q = q.map((v, k) => v + share * (sign * b[k] - v));
  const n = Math.hypot(...q) || 1;
  return { i, pos: mix("pos", 3), q: q.map(v => v / n), at: i + share };
}
const yawOf = ([x, y, z, w]) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));

class TrackMap {
  constructor(canvas) {
    this.canvas = canvas;
    this.all();
    addView(canvas, () => this.draw());
    this.gestures();
  }
  all() {
    const north = [], east = [];
    const take = (n, e) => { if (Number.isFinite(n + e)) { north.push(n); east.push(e); } };
    for (const t of flown) {
      for (let i = 0; i < t.pos.length; i += 3) take(t.pos[i], t.pos[i + 1]);
      if (t.home) take(t.home[0], t.home[1]);
      for (const w of t.waypoints) take(w[0], w[1]);
    }
    const least = v => v.reduce((a, b) => Math.min(a, b), Infinity), most = v => v.reduce((a, b) => Math.max(a, b), -Infinity);
    const [n0, n1, e0, e1] = north.length ? [least(north), most(north), least(east), most(east)] : [-5, 5, -5, 5];
    this.centre = [(n0 + n1) / 2, (e0 + e1) / 2];
    this.extent = [Math.max(n1 - n0, 4), Math.max(e1 - e0, 4)];
    this.scale = null;
    redraw();
  }
  zoom(factor) { this.scale = (this.scale ?? this.fit()) * factor; redraw(); }
  fit() { return Math.min((this.canvas.clientWidth - 70) / this.extent[1], (this.canvas.clientHeight - 80) / this.extent[0]); }
  gestures() {
    const canvas = this.canvas, fingers = new Map();
    canvas.onpointerdown = e => { fingers.set(e.pointerId, [e.offsetX, e.offsetY]); if (e.pointerType === "mouse") canvas.setPointerCapture(e.pointerId); };
    canvas.onpointermove = e => {
      if (!fingers.has(e.pointerId)) return;
      const before = [...fingers.values()], spread = f => f.length > 1 ? Math.max(Math.hypot(f[0][0] - f[1][0], f[0][1] - f[1][1]), 10) : 1;
      fingers.set(e.pointerId, [e.offsetX, e.offsetY]);
      const after = [...fingers.values()], scale = this.scale ??= this.fit();
      this.centre[0] += e.movementY / scale / after.length; this.centre[1] -= e.movementX / scale / after.length;
      this.scale *= spread(after) / spread(before);
      redraw();
    };
    canvas.onpointerup = canvas.onpointercancel = e => fingers.delete(e.pointerId);
    canvas.addEventListener("wheel", e => { if (e.ctrlKey || e.metaKey) { e.preventDefault(); this.zoom(Math.exp(-0.003 * e.deltaY)); } }, { passive: false });
    canvas.addEventListener("touchstart", e => { if (e.touches.length > 1) e.preventDefault(); }, { passive: false });
    canvas.onclick = e => this.seek(e.offsetX, e.offsetY);
  }
  seek(px, py) {  // to when it was there
    let best = 400, when = null;
    for (const t of flown) for (let i = 0; i < t.times.length; i++) {
      const d = (this.x(t.pos[3 * i + 1]) - px) ** 2 + (this.y(t.pos[3 * i]) - py) ** 2;
      if (d < best) { best = d; when = t.times[i]; }
    }
    if (when !== null) setCursor(when);
  }
  draw() {
    const { g, width, height } = fitted(this.canvas), scale = this.scale ?? this.fit();
    this.x = east => width / 2 + (east - this.centre[1]) * scale;
    this.y = north => height / 2 - (north - this.centre[0]) * scale;
    this.grid(g, width, height, scale);
    tracks.forEach((t, k) => { if (t) this.track(g, t, k); });
    tracks.forEach((t, k) => { if (t) this.marks(g, t, k); });
    this.scaleBar(g, width, height, scale);
  }
  grid(g, width, height, scale) {
    const step = ticks(0, width / scale, width / 90).step;
    g.strokeStyle = palette.grid; g.lineWidth = 1; g.beginPath();
    for (let e = Math.ceil((this.centre[1] - width / 2 / scale) / step) * step; this.x(e) < width; e += step) { g.moveTo(this.x(e), 0); g.lineTo(this.x(e), height); }
    for (let n = Math.ceil((this.centre[0] - height / 2 / scale) / step) * step; this.y(n) > 0; n += step) { g.moveTo(0, this.y(n)); g.lineTo(width, this.y(n)); }
    g.stroke();
  }
  path(g, points, width, colour, dash, from = 0, to = Infinity) {
    g.strokeStyle = colour; g.lineWidth = width; g.setLineDash(dash); g.beginPath();
    for (let i = from; i < Math.min(to, points.length / 3); i++) {
      const at = [this.x(points[3 * i + 1]), this.y(points[3 * i])];
      if (i > from) g.lineTo(...at); else g.moveTo(...at);
    }
    g.stroke(); g.setLineDash([]);
  }
  track(g, t, k) {
    if (t.setpoint.length && !several) this.path(g, t.setpoint, 1, palette.soft, [4, 3]);
    const isZoomed = shown.from > whole[0] || shown.to < whole[1];
    g.globalAlpha = isZoomed ? 0.3 : 1;
    this.path(g, t.pos, 2, colourOf(k), []);
    g.globalAlpha = 1;
    if (isZoomed) this.path(g, t.pos, 3, colourOf(k), [], Math.max(indexAt(t.times, shown.from), 0), indexAt(t.times, shown.to) + 1);
  }
  marks(g, t, k) {
    g.textAlign = "center"; g.textBaseline = "middle"; g.lineWidth = 1.5;
    t.waypoints.forEach((w, number) => {
      const x = this.x(w[1]), y = this.y(w[0]);
      g.fillStyle = palette.card; g.strokeStyle = palette.soft;
      g.beginPath(); g.arc(x, y, 8, 0, 7); g.fill(); g.stroke();
      g.fillStyle = palette.ink; g.fillText(number + 1, x, y + 0.5);
    });
    const n = t.times.length - 1;
    this.dot(g, t.pos, 0, palette.good); this.dot(g, t.pos, n, palette.bad);
    if (t.home) {
      const x = this.x(t.home[1]), y = this.y(t.home[0]);
      g.fillStyle = palette.ink; g.fillRect(x - 8, y - 8, 16, 16);
      g.fillStyle = palette.card; g.font = "bold 12px system-ui, sans-serif"; g.fillText("H", x, y + 0.5); g.font = "11.5px system-ui, sans-serif";
    }
    const now = stateAt(t, shown.cursor), yaw = yawOf(now.q), x = this.x(now.pos[1]), y = this.y(now.pos[0]);
    g.save(); g.translate(x, y); g.rotate(yaw);
    g.fillStyle = colourOf(k); g.strokeStyle = palette.card; g.lineWidth = 1.5;
    g.beginPath(); g.moveTo(0, -11); g.lineTo(7, 8); g.lineTo(0, 4); g.lineTo(-7, 8); g.closePath(); g.fill(); g.stroke();
    g.restore();
  }
  dot(g, pos, i, colour) {
    g.fillStyle = colour; g.strokeStyle = palette.card; g.lineWidth = 1.5;
    g.beginPath(); g.arc(this.x(pos[3 * i + 1]), this.y(pos[3 * i]), 5, 0, 7); g.fill(); g.stroke();
  }
  scaleBar(g, width, height, scale) {
    const metres = ticks(0, 130 / scale, 1).step, length = metres * scale * (metres * scale > 140 ? 0.5 : 1);
    const told = +(length / scale).toPrecision(3), left = 14, bottom = height - 14;
    g.strokeStyle = g.fillStyle = palette.ink; g.lineWidth = 1.5;
    g.beginPath(); g.moveTo(left, bottom - 5); g.lineTo(left, bottom); g.lineTo(left + length, bottom); g.lineTo(left + length, bottom - 5); g.stroke();
    g.textAlign = "left"; g.textBaseline = "bottom"; g.fillText(told >= 1000 ? `${told / 1000} km` : `${told} m`, left + 2, bottom - 6);
    g.save(); g.translate(20, 26);
    g.beginPath(); g.moveTo(0, -14); g.lineTo(5, 4); g.lineTo(0, 1); g.lineTo(-5, 4); g.closePath(); g.fill();
    g.textAlign = "center"; g.textBaseline = "top"; g.fillText("N", 0, 7);
    g.restore();
  }
}
