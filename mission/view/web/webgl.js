// Drawing with WebGL, for the pages that show flights: arrays of the page's data, vectors and matrices, triangles.
"use strict";
const TYPES = { f4: Float32Array, u4: Uint32Array, u1: Uint8Array };
function array(a) {  // {type, data}: base64 of little-endian numbers
  const text = atob(a.data), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new TYPES[a.type](bytes.buffer);
}

// ---- vectors and matrices, column by column as WebGL takes them ----
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
function lookAt(eye, target) {
  const z = unit(sub(eye, target)), x = unit(cross([0, 0, -1], z)), y = cross(z, x);
  return [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];
}
function perspective(fov, aspect, near, far) {
  const f = 1 / Math.tan(fov / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
}
function pose(p, q) {  // q: x, y, z, w
  const [x, y, z, w] = q;
  return [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
          2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
          2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0, p[0], p[1], p[2], 1];
}
function times4(a, b) {
  const c = new Array(16).fill(0);
  for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) c[4 * i + j] += a[4 * k + j] * b[4 * i + k];
  return c;
}
const yawQuat = a => [0, 0, Math.sin(a / 2), Math.cos(a / 2)];
const STILL = pose([0, 0, 0], [0, 0, 0, 1]);

const VERTEX_SHADER = `#version 300 es
  layout(location=0) in vec3 pos; layout(location=1) in vec3 normal; layout(location=2) in vec3 colour;
  layout(location=3) in vec3 place; layout(location=4) in vec3 size; layout(location=5) in vec3 tint;
  uniform mat4 model, view; uniform float lit; uniform vec3 sun; out vec3 shade; out float depth;
  void main() {
    vec3 n = normalize(mat3(model) * (normal / size));
    float light = mix(1.0, 0.62 + 0.42 * dot(n, sun), lit);
    shade = (tint.r < 0.0 ? colour : tint) * light;
    gl_Position = view * (model * vec4(pos * size + place, 1.0));
    depth = gl_Position.w;
  }`;
const FRAGMENT_SHADER = `#version 300 es
  precision mediump float; in vec3 shade; in float depth; out vec4 colour; uniform float opacity; uniform float far;
  uniform vec3 sky;
  void main() {
    float fog = smoothstep(0.3 * far, far, depth);
    colour = vec4(mix(shade, sky, fog), opacity);
  }`;

class Renderer {  // triangles on one canvas, lit by one sun, fading into the sky far away
  constructor(canvas, sunNed, sky) {
    const gl = this.gl = canvas.getContext("webgl2", { alpha: false, antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL");
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX_SHADER], [gl.FRAGMENT_SHADER, FRAGMENT_SHADER]]) {
      const s = gl.createShader(kind);
      gl.shaderSource(s, source); gl.compileShader(s);
      if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
      gl.attachShader(program, s);
    }
    gl.linkProgram(program); gl.useProgram(program);
    this.U = {};
    for (const name of ["model", "view", "lit", "sun", "opacity", "far", "sky"]) this.U[name] = gl.getUniformLocation(program, name);
    gl.uniform3fv(this.U.sun, unit(sunNed));
    gl.enable(gl.DEPTH_TEST); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.paintSky(sky);
  }
  paintSky(sky) { this.gl.uniform3fv(this.U.sky, sky); this.gl.clearColor(...sky, 1); }
  attribute(at, values, size, type, isPerInstance) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, type, type === gl.UNSIGNED_BYTE, 0, 0);
    if (isPerInstance) gl.vertexAttribDivisor(at, 1);
  }
  thing(vertices, faces, colours, many) {
    const gl = this.gl, normals = new Float32Array(vertices.length), at = i => [vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]];
    for (let f = 0; f < faces.length; f += 3) {
      const [a, b, c] = [at(faces[f]), at(faces[f + 1]), at(faces[f + 2])], n = cross(sub(b, a), sub(c, a));
      for (let k = 0; k < 3; k++) for (let d = 0; d < 3; d++) normals[3 * faces[f + k] + d] += n[d];
    }
    const vao = gl.createVertexArray();
    gl.bindVertexArray(vao);
    this.attribute(0, vertices, 3, gl.FLOAT); this.attribute(1, normals, 3, gl.FLOAT); this.attribute(2, colours, 3, gl.UNSIGNED_BYTE);
    if (many) {
      this.attribute(3, many.place, 3, gl.FLOAT, true); this.attribute(4, many.size, 3, gl.FLOAT, true);
      this.attribute(5, many.tint, 3, gl.UNSIGNED_BYTE, true);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
    return { vao, length: faces.length, count: many ? many.place.length / 3 : 0 };
  }
  mesh(m, many) { return this.thing(array(m.vertices), array(m.faces), array(m.colours), many); }
  draw(it, model, lit = 1, opacity = 1, length = it.length) {
    const gl = this.gl, U = this.U;
    gl.bindVertexArray(it.vao);
    gl.uniformMatrix4fv(U.model, false, model); gl.uniform1f(U.lit, lit); gl.uniform1f(U.opacity, opacity);
    if (it.count) return gl.drawElementsInstanced(gl.TRIANGLES, length, gl.UNSIGNED_INT, 0, it.count);
    gl.vertexAttrib3f(3, 0, 0, 0); gl.vertexAttrib3f(4, 1, 1, 1); gl.vertexAttrib3f(5, -1, 0, 0);
    gl.drawElements(gl.TRIANGLES, length, gl.UNSIGNED_INT, 0);
  }
  ribbon(points, rgb, width) {  // a level band along points, two triangles each
    const n = points.length / 3, v = new Float32Array(6 * n), f = new Uint32Array(6 * Math.max(n - 1, 0)), c = new Uint8Array(6 * n);
    for (let i = 0; i < n; i++) {
      const a = Math.max(i - 1, 0), b = Math.min(i + 1, n - 1);
      let dx = points[3 * b] - points[3 * a], dy = points[3 * b + 1] - points[3 * a + 1];
      const l = Math.hypot(dx, dy) || 1; dx *= width / l; dy *= width / l;
      v.set([points[3 * i] - dy, points[3 * i + 1] + dx, points[3 * i + 2], points[3 * i] + dy, points[3 * i + 1] - dx, points[3 * i + 2]], 6 * i);
      c.set([...rgb, ...rgb], 6 * i);
      if (i < n - 1) f.set([2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 1, 2 * i + 3, 2 * i + 2], 6 * i);
    }
    return this.thing(v, f, c);
  }
}
