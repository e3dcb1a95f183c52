// What the tool and the object look like, in WebGL: meshes, one shader, a camera. Millimetres in the rig's frame, z up.
// Knows nothing of the network: draw() takes plain values.

// ---- vectors and matrices; a matrix is 16 numbers, column by column

export function perspective(fovRad, aspect, near, far) {
  const f = 1 / Math.tan(fovRad / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
}
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const norm = (a) => Math.hypot(a[0], a[1], a[2]);
export function unit(a) {
  const n = norm(a);
  return n > 1e-9 ? [a[0] / n, a[1] / n, a[2] / n] : [0, 0, 1];
}
export function times(a, b) {
  const m = new Array(16);
  for (let c = 0; c < 4; c++) {
    for (let r = 0; r < 4; r++) {
      m[4 * c + r] = a[r] * b[4 * c] + a[4 + r] * b[4 * c + 1] + a[8 + r] * b[4 * c + 2] + a[12 + r] * b[4 * c + 3];
    }
  }
  return m;
}
export function lookAt(eye, at, up) {
  const z = unit(minus(eye, at)), x = unit(cross(up, z)), y = cross(z, x);
  return [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];
}
/// Columns x, y, z and a place.
export const frame = (x, y, z, at) => [...x, 0, ...y, 0, ...z, 0, ...at, 1];
export const placed = (at, s = 1) => frame([s, 0, 0], [0, s, 0], [0, 0, s], at);
export function rotated(q, v) {
  const t = cross([q.x, q.y, q.z], v).map((c) => 2 * c);
  return plus(plus(v, t, q.w), cross([q.x, q.y, q.z], t));
}
export const posed = (q, at) => frame(rotated(q, [1, 0, 0]), rotated(q, [0, 1, 0]), rotated(q, [0, 0, 1]), at);
/// z along a direction.
export function along(direction, at, length = 1, width = 1) {
  const z = unit(direction);
  const x = unit(cross(Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], z));
  const y = cross(z, x);
  return frame(x.map((c) => c * width), y.map((c) => c * width), z.map((c) => c * length), at);
}
/// Maps the unit sphere to the ellipsoid of so many standard deviations: by Cholesky's factor, no axes needed. What is
/// smaller than `least` mm is drawn that large.
export function ellipsoid(c, at, deviations = 2, least = 0.4) {
  const add = (least / deviations) ** 2;
  const a = Math.sqrt(Math.max(c.xx, 0) + add);
  const b = c.xy / a, d = c.xz / a;
  const e = Math.sqrt(Math.max(c.yy + add - b * b, 1e-12));
  const f = (c.yz - b * d) / e;
  const g = Math.sqrt(Math.max(c.zz + add - d * d - f * f, 1e-12));
  const s = deviations;
  return frame([s * a, s * b, s * d], [0, s * e, s * f], [0, 0, s * g], at);
}
/// Place of a point on the screen, 0 … 1 from the left and the top; nothing behind the camera.
export function projected(viewProjection, p) {
  const m = viewProjection;
  const w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
  if (w <= 0) return null;
  const x = (m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12]) / w;
  const y = (m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13]) / w;
  return [0.5 + 0.5 * x, 0.5 - 0.5 * y];
}

// ---- meshes: { vertices: x y z of place and of normal, indices }

/// Points (radius, height) turned about z, from the top down.
function turned(profile, steps = 40) {
  const vertices = [], indices = [];
  profile.forEach(([r, z, nr, nz]) => {
    for (let i = 0; i <= steps; i++) {
      const a = 2 * Math.PI * i / steps, c = Math.cos(a), s = Math.sin(a);
      vertices.push(r * c, r * s, z, nr * c, nr * s, nz);
    }
  });
  for (let k = 0; k + 1 < profile.length; k++) {
    for (let i = 0; i < steps; i++) {
      const a = k * (steps + 1) + i, b = a + steps + 1;
      indices.push(a, b, a + 1, a + 1, b, b + 1);
    }
  }
  return { vertices, indices };
}
const arc = (from, to, steps) =>
  Array.from({ length: steps + 1 }, (_, i) => from + (to - from) * i / steps)
    .map((a) => [Math.sin(a), Math.cos(a), Math.sin(a), Math.cos(a)]);

export const meshes = {
  sphere: () => turned(arc(0, Math.PI, 20), 28),
  /// Apex at the origin, radius 1.
  dome: () => {
    const mesh = turned(arc(0, Math.PI / 2, 40), 64);
    for (let i = 2; i < mesh.vertices.length; i += 6) mesh.vertices[i] -= 1;
    return mesh;
  },
  /// A stylus: its tip at the origin, z to its end.
  tool: (length = 130, radius = 4, ball = 4) => {
    const slim = radius * 0.45;
    const ballPart = arc(Math.PI, 0.35, 14).map(([r, z, nr, nz]) => [ball * r, ball * (1 + z) - ball, nr, nz]);
    return turned([...ballPart, [slim, ball * 0.9, 1, 0], [slim, 30, 1, 0], [radius, 40, 0.9, -0.4], [radius, length, 1, 0],
      [radius, length, 0, 1], [0, length, 0, 1]], 24);
  },
  /// Arrow from the origin to z = 1.
  arrow: () => turned([[0, 1, 0, 1], [0.1, 0.76, 0.9, 0.3], [0.1, 0.76, 0, -1], [0.035, 0.76, 0, -1], [0.035, 0.76, 1, 0],
    [0.035, 0, 1, 0], [0, 0, 0, -1]], 20),
  table: (half = 120, z = 0) => ({
    vertices: [-half, -half, z, 0, 0, 1, half, -half, z, 0, 0, 1, half, half, z, 0, 0, 1, -half, half, z, 0, 0, 1],
    indices: [0, 1, 2, 0, 2, 3],
  }),
};

const VERTEX = `
attribute vec3 place; attribute vec3 normal;
uniform mat4 viewProjection, model; uniform vec3 dentAt, dentNormal; uniform float dentDepth, dentWidth;
varying vec3 worldPlace, worldNormal;
void main() {
  vec4 p = model * vec4(place, 1.0);
  vec3 n = normalize(mat3(model) * normal);
  vec3 away = p.xyz - dentAt;
  vec3 side = away - dentNormal * dot(away, dentNormal);
  float depth = dentDepth * exp(-dot(side, side) / (2.0 * dentWidth * dentWidth));
  p.xyz -= dentNormal * depth;
  n = normalize(n + side * depth / (dentWidth * dentWidth));
  worldPlace = p.xyz; worldNormal = n;
  gl_Position = viewProjection * p;
}`;

const FRAGMENT = `
precision highp float;
uniform vec4 colour; uniform vec3 eye; uniform float gloss, rim, checker, grain, seed;
varying vec3 worldPlace, worldNormal;
float noise(vec2 p) { return fract(sin(dot(p, vec2(12.9898, 78.233)) + seed) * 43758.5453); }
void main() {
  vec3 n = normalize(worldNormal), toEye = normalize(eye - worldPlace);
  if (dot(n, toEye) < 0.0) n = -n;
  vec3 light = normalize(vec3(-0.4, -0.6, 1.0));
  float lit = 0.35 + 0.65 * max(dot(n, light), 0.0);
  float shine = gloss * pow(max(dot(reflect(-light, n), toEye), 0.0), 30.0);
  float edge = rim * pow(1.0 - abs(dot(n, toEye)), 2.0);
  vec3 base = colour.rgb;
  if (checker > 0.0) base *= 0.8 + 0.2 * mod(floor(worldPlace.x / checker) + floor(worldPlace.y / checker), 2.0);
  base = base * lit + vec3(shine) + colour.rgb * edge;
  base += grain * (noise(gl_FragCoord.xy) - 0.5);
  float a = clamp(colour.a + edge * step(0.001, rim), 0.0, 1.0);
  gl_FragColor = vec4(base * a, a);
}`;

/// True if no graphics card draws.
function isDrawnByProcessor() {
  const gl = document.createElement('canvas').getContext('webgl');
  const names = gl && gl.getExtension('WEBGL_debug_renderer_info');
  const name = names ? String(gl.getParameter(names.UNMASKED_RENDERER_WEBGL)) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software/i.test(name);
}

export class Scene3d {
  /// Throws if the browser has no WebGL.
  constructor(canvas) {
    this.canvas = canvas;
    this.byProcessor = isDrawnByProcessor();
    // Smooth edges are four times the work: a processor draws more pictures instead.
    const gl = canvas.getContext('webgl', { alpha: true, antialias: !this.byProcessor, premultipliedAlpha: true });
    if (!gl) throw new Error('this browser has no WebGL');
    this.gl = gl;
    this.program = this.link(VERTEX, FRAGMENT);
    this.places = {};
    for (const name of ['viewProjection', 'model', 'dentAt', 'dentNormal', 'dentDepth', 'dentWidth', 'colour', 'eye', 'gloss', 'rim',
      'checker', 'grain', 'seed']) this.places[name] = gl.getUniformLocation(this.program, name);
    this.place = gl.getAttribLocation(this.program, 'place');
    this.normal = gl.getAttribLocation(this.program, 'normal');
    this.buffers = new Map();
    for (const [name, make] of Object.entries(meshes)) this.addMesh(name, make());
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  link(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    return program;
  }

  addMesh(name, mesh) {
    const gl = this.gl, buffer = { count: mesh.indices.length, vertices: gl.createBuffer(), indices: gl.createBuffer() };
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer.vertices);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(mesh.vertices), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer.indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(mesh.indices), gl.STATIC_DRAW);
    this.buffers.set(name, buffer);
  }

  /// Follows the size of the element; a ratio below 1 draws fewer pixels than the screen has.
  resize(maxRatio = 1.5) {
    const ratio = maxRatio < 1 ? maxRatio : Math.min(window.devicePixelRatio || 1, maxRatio);
    const w = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), h = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== w || this.canvas.height !== h) Object.assign(this.canvas, { width: w, height: h });
  }

  /// `views`: [{ x, width: shares of the canvas, eye, at, up, fov }]. `parts`: [{ mesh, model, colour: [r, g, b, a], gloss, rim,
  /// checker, grain, dent: { at, normal, depth, width }, onTop, clearsDepth }], drawn in their order; those with a < 1 write no depth.
  /// Returns the viewProjection of each view.
  draw(views, parts, background = [0, 0, 0, 0]) {
    const gl = this.gl, p = this.places;
    gl.disable(gl.SCISSOR_TEST);  // of the picture before: all of it is cleared
    gl.clearColor(...background);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.program);
    gl.enableVertexAttribArray(this.place);
    gl.enableVertexAttribArray(this.normal);
    gl.enable(gl.SCISSOR_TEST);
    return views.map((view) => {
      const x = Math.round(view.x * this.canvas.width), w = Math.round(view.width * this.canvas.width);
      gl.viewport(x, 0, w, this.canvas.height);
      gl.scissor(x, 0, w, this.canvas.height);
      const viewProjection = times(perspective(view.fov, w / this.canvas.height, 10, 2000), lookAt(view.eye, view.at, view.up));
      gl.uniformMatrix4fv(p.viewProjection, false, viewProjection);
      gl.uniform3fv(p.eye, view.eye);
      gl.uniform1f(p.seed, performance.now() % 7);
      for (const part of parts) this.drawPart(part);
      return viewProjection;
    });
  }

  drawPart(part) {
    const gl = this.gl, p = this.places, buffer = this.buffers.get(part.mesh), dent = part.dent;
    if (part.clearsDepth) gl.clear(gl.DEPTH_BUFFER_BIT);
    if (part.onTop) gl.disable(gl.DEPTH_TEST); else gl.enable(gl.DEPTH_TEST);
    gl.depthMask(part.colour[3] >= 1);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer.vertices);
    gl.vertexAttribPointer(this.place, 3, gl.FLOAT, false, 24, 0);
    gl.vertexAttribPointer(this.normal, 3, gl.FLOAT, false, 24, 12);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer.indices);
    gl.uniformMatrix4fv(p.model, false, part.model);
    gl.uniform4fv(p.colour, part.colour);
    gl.uniform1f(p.gloss, part.gloss || 0);
    gl.uniform1f(p.rim, part.rim || 0);
    gl.uniform1f(p.checker, part.checker || 0);
    gl.uniform1f(p.grain, part.grain || 0);
    gl.uniform3fv(p.dentAt, dent ? dent.at : [0, 0, 0]);
    gl.uniform3fv(p.dentNormal, dent ? dent.normal : [0, 0, 1]);
    gl.uniform1f(p.dentDepth, dent ? dent.depth : 0);
    gl.uniform1f(p.dentWidth, dent ? dent.width : 1);
    gl.drawElements(gl.TRIANGLES, buffer.count, gl.UNSIGNED_SHORT, 0);
    gl.depthMask(true);
  }
}
