// The flight in three dimensions: a grid on the ground, the tracks with their heights, the vehicles as they were turned.
"use strict";
const GRID_LINES = 20;

class FlightScene {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new Renderer(canvas, data.sun_ned, rgbOf(palette.sky).map(v => v / 255));
    this.extent();
    this.follows = false;
    this.turn = 0.6; this.rise = 0.45; this.away = 6;
    this.build();
    addView(canvas, () => this.draw());
    this.gestures();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.renderer.paintSky(rgbOf(palette.sky).map(v => v / 255)); this.build(); redraw(); });
  }
  extent() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const t of flown) for (let i = 0; i < t.pos.length; i++) { low[i % 3] = Math.min(low[i % 3], t.pos[i]); high[i % 3] = Math.max(high[i % 3], t.pos[i]); }
    this.middle = low.map((v, k) => (v + high[k]) / 2);
    this.size = Math.max(...high.map((v, k) => v - low[k]), 4);
    this.ground = flown[0].home ? flown[0].home[2] : high[2];  // down is positive
  }
  build() {
    const r = this.renderer, ground = this.ground;
    const step = ticks(0, this.size, 8).step, half = GRID_LINES / 2 * step;
    const [n0, e0] = [Math.round(this.middle[0] / step) * step, Math.round(this.middle[1] / step) * step];
    const wide = 0.0018 * this.size, colour = rgbOf(palette.line), lines = [];
    for (let k = -GRID_LINES / 2; k <= GRID_LINES / 2; k++) {
      lines.push(r.ribbon([n0 + k * step, e0 - half, ground, n0 + k * step, e0 + half, ground], colour, wide));
      lines.push(r.ribbon([n0 - half, e0 + k * step, ground, n0 + half, e0 + k * step, ground], colour, wide));
    }
    this.lines = lines; this.step = step;
    const floor = [n0 - half, e0 - half, ground + 0.02, n0 + half, e0 - half, ground + 0.02, n0 + half, e0 + half, ground + 0.02, n0 - half, e0 + half, ground + 0.02];
    this.floor = r.thing(new Float32Array(floor), new Uint32Array([0, 1, 2, 0, 2, 3]), new Uint8Array(Array(4).fill(rgbOf(palette.ground)).flat()));
    this.things = tracks.map((t, k) => t && {
      track: t, near: this.band(t.pos, rgbOf(colourOf(k)), 0.02), line: this.band(t.pos, rgbOf(colourOf(k)), 0.0028 * this.size), wall: this.curtain(t.pos, rgbOf(colourOf(k))), veil: this.veil(t.pos),
      shadow: r.ribbon(t.pos.map((v, i) => i % 3 === 2 ? ground - 0.01 : v), rgbOf(palette.soft), 0.0012 * this.size), body: r.mesh(data.vehicles[k]),
    }).filter(Boolean);
    by("scene-note").textContent = `grid of ${step} m`;
  }
  band(pos, rgb, width) {  // a level band and an upright one: seen from everywhere
    const lifted = w => pos.map((v, i) => i % 3 === 2 ? v - w : v);
    return [this.renderer.ribbon(pos, rgb, width), this.curtain(lifted(width), rgb, lifted(-width))];
  }
  veil(pos) {  // how opaque a curtain is: many rounds lie behind one another
    let length = 0;
    for (let i = 3; i < pos.length; i += 3) length += Math.hypot(pos[i] - pos[i - 3], pos[i + 1] - pos[i - 2]);
    return 0.14 / Math.max(1, length / (4 * this.size));
  }
  curtain(pos, rgb, below) {  // from the track down to the ground
    const n = pos.length / 3, v = new Float32Array(2 * pos.length), f = new Uint32Array(6 * Math.max(n - 1, 0)), c = new Uint8Array(2 * pos.length);
    for (let i = 0; i < n; i++) {
      v.set([pos[3 * i], pos[3 * i + 1], pos[3 * i + 2], ...(below ? below.slice(3 * i, 3 * i + 3) : [pos[3 * i], pos[3 * i + 1], this.ground])], 6 * i);
      c.set([...rgb, ...rgb], 6 * i);
      if (i < n - 1) f.set([2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 1, 2 * i + 3, 2 * i + 2], 6 * i);
    }
    return this.renderer.thing(v, f, c);
  }
  zoom(factor) {
    if (this.follows) this.away = Math.min(Math.max(this.away * factor, 1.5), 4 * this.size + 20);
    else this.far = Math.min(Math.max((this.far ?? 1.3 * this.size) * factor, 2), 6 * this.size + 20);
    redraw();
  }
  gestures() {
    const canvas = this.canvas, fingers = new Map();
    canvas.onpointerdown = e => { fingers.set(e.pointerId, [e.offsetX, e.offsetY]); if (e.pointerType === "mouse") canvas.setPointerCapture(e.pointerId); };
    canvas.onpointermove = e => {
      if (!fingers.has(e.pointerId)) return;
      const spread = () => { const f = [...fingers.values()]; return f.length > 1 ? Math.max(Math.hypot(f[0][0] - f[1][0], f[0][1] - f[1][1]), 10) : 0; };
      const before = spread();
      fingers.set(e.pointerId, [e.offsetX, e.offsetY]);
      if (before) return this.zoom(before / spread());
      this.turn += 0.008 * e.movementX;
      if (e.pointerType === "mouse") this.rise = Math.min(1.5, Math.max(0.03, this.rise + 0.008 * e.movementY));
      redraw();
    };
    canvas.onpointerup = canvas.onpointercancel = e => fingers.delete(e.pointerId);
    canvas.addEventListener("wheel", e => { if (e.ctrlKey || e.metaKey) { e.preventDefault(); this.zoom(Math.exp(0.003 * e.deltaY)); } }, { passive: false });
    canvas.addEventListener("touchstart", e => { if (e.touches.length > 1) e.preventDefault(); }, { passive: false });
  }
  draw() {
    const { canvas, renderer: r } = this, gl = r.gl, ratio = Math.min(devicePixelRatio || 1, 2);
    const w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const states = this.things.map(it => stateAt(it.track, shown.cursor));
    const centre = this.follows ? states[0].pos : this.middle, away = this.follows ? this.away : this.far ?? 1.3 * this.size;
    const level = away * Math.cos(this.rise), eye = [centre[0] - level * Math.cos(this.turn), centre[1] - level * Math.sin(this.turn), centre[2] - away * Math.sin(this.rise)];
    eye[2] = Math.min(eye[2], this.ground - 0.3);
    gl.viewport(0, 0, w, h); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(r.U.view, false, times4(perspective(1.0, w / h, Math.max(0.1, 0.01 * away), 60 * this.size + 200), lookAt(eye, centre)));
    gl.uniform1f(r.U.far, 8 * this.size + 4 * away);
    r.draw(this.floor, STILL, 0);
    gl.disable(gl.DEPTH_TEST);
    for (const line of this.lines) r.draw(line, STILL, 0);
    if (!this.follows) for (const it of this.things) r.draw(it.shadow, STILL, 0);
    gl.enable(gl.DEPTH_TEST);
    const enlarged = this.follows ? 1 : Math.max(1, 0.11 * away);
    this.things.forEach((it, k) => {
      for (const part of this.follows ? it.near : it.line) r.draw(part, STILL, 0);
      const m = pose(states[k].pos, states[k].q);
      r.draw(it.body, m.map((v, i) => i < 12 ? v * enlarged : v));
    });
    gl.enable(gl.BLEND); gl.depthMask(false);
    for (const it of this.things) r.draw(it.wall, STILL, 0, it.veil);
    gl.disable(gl.BLEND); gl.depthMask(true);
  }
}
