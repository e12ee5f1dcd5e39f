// The machine in three dimensions: simple shapes, one light, its shadow on the floor.
"use strict";
class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = this.gl = canvas.getContext("webgl", {antialias: true, alpha: true, stencil: true, premultipliedAlpha: true});
    this.shapes = []; this.boxes = []; this.planes = []; this.joints = []; this.grips = []; this.twin = [];
    this.camera = {yaw: -.9, pitch: .42, distance: 5, target: [0, 0, 0]};
    this.floor = 0; this.extent = 1; this.newtons = NEWTONS; this.grabbed = null; this.onlead = null; this.framed = false;
    if (!gl) return;
    this.solid = this.program(
      "attribute vec3 p,n;uniform mat4 v,m;uniform mat3 q;varying vec3 w,k;void main(){vec4 a=m*vec4(p,1.);w=a.xyz;k=q*n;gl_Position=v*a;}",
      "precision mediump float;uniform vec4 c;uniform vec3 e,l;uniform float lit;varying vec3 w,k;void main(){vec3 n=normalize(k);" +
      "float d=max(dot(n,l),0.),s=pow(max(dot(n,normalize(l+normalize(e-w))),0.),40.)*.22;" +
      "float h=.52+.16*n.z;vec3 r=lit>.5?c.rgb*(h+.52*d)+s:c.rgb;gl_FragColor=vec4(r*c.a,c.a);}");
    this.meshes = {box: this.mesh(...box()), cylinder: this.mesh(...turned([[1, -.5, 0], [1, .5, 0]], true)),
      sphere: this.mesh(...ball()), cone: this.mesh(...turned([[1, 0, .4], [0, 1, .4]], true)), quad: this.mesh(...quad())};
    this.lines = gl.createBuffer();
    this.pointers();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }
  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, "p"); gl.bindAttribLocation(program, 1, "n"); gl.linkProgram(program);
    const at = name => gl.getUniformLocation(program, name);
    return {program, v: at("v"), m: at("m"), q: at("q"), c: at("c"), e: at("e"), l: at("l"), lit: at("lit")};
  }
  mesh(points, normals) {
    const gl = this.gl, data = new Float32Array(points.length * 2);
    for (let i = 0; i < points.length; i += 3) { data.set(points.slice(i, i + 3), 2 * i); data.set(normals.slice(i, i + 3), 2 * i + 3); }
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return {buffer, count: points.length / 3};
  }
  begin(hello) { // another machine
    this.strength = []; this.reachable = []; this.boxes = hello.boxes; this.planes = hello.planes; this.joints = []; this.grips = []; this.twin = []; this.framed = false;
    this.shapes = hello.shapes.map(s => ({joint: s.joint, colour: s.colour, parts: parts(s)}));
  }
  show(frame) {
    if (!frame.joints) return;
    this.joints = [M.pose([0, 0, 0, 0, 0, 0, 1])];
    for (let at = 0; at < frame.joints.length; at += 7) this.joints.push(M.pose(frame.joints, at));
    this.grips = threes(frame.grips); this.wrenches = threes(frame.wrench);
    this.twin = ["ENGAGING", "ACTIVE"].includes(frame.mode) && frame.twin ? threes(frame.twin) : [];
    this.strength = threes(frame.strength ?? []); this.reachable = threes(frame.reachable ?? []);
    if (!this.framed) this.frameAll();
  }
  frameAll() { // the camera sees all of the machine
    const lower = [1e9, 1e9, 1e9], upper = [-1e9, -1e9, -1e9], points = [];
    const reach = p => { for (let i = 0; i < 3; i++) { lower[i] = Math.min(lower[i], p[i]); upper[i] = Math.max(upper[i], p[i]); } };
    for (const shape of this.shapes) for (const part of shape.parts) {
      const m = M.times(this.joints[shape.joint], part.matrix);
      points.push(...CORNERS.map(c => M.point(m, V.scale(c, part.kind === "box" ? .5 : .7)).slice(0, 3)));
    }
    if (!points.length) return;
    points.push(...this.grips); points.forEach(reach);
    for (const b of this.boxes) { reach(b.lower.map((v, i) => v ?? lower[i])); reach(b.upper.map((v, i) => v ?? upper[i])); }
    this.lower = lower; this.upper = upper; this.extent = V.size(V.sub(upper, lower)) / 2;
    for (const b of this.boxes) points.push(...this.edges(b));
    for (const p of this.planes) points.push(...this.corners(p));
    const flat = upper[2] - lower[2] < .2 * this.extent;
    this.floor = lower[2] - (flat ? .25 * this.extent : 0);
    this.camera = {yaw: -.6, pitch: flat ? .85 : .36, distance: 0, target: V.scale(V.add(lower, upper), .5)};
    const strongest = Math.max(...this.strength.map(V.size)); // its ellipsoid is to be seen, however weak it is
    this.newtons = strongest > 0 ? Math.min(NEWTONS, strongest) : NEWTONS;
    this.points = points; this.framed = true; this.fit();
  }
  fit() { // from where the camera looks: as near as all points let it, which are in the middle then
    const camera = this.camera, {clientWidth: w, clientHeight: h} = this.canvas, t = Math.tan(FOV / 2) * FILLED;
    const z = V.unit(V.sub(camera.target, this.eye(1))), x = V.unit(V.cross(z, [0, 0, 1])), y = V.cross(x, z);
    for (const [axis, share] of [[x, w / Math.max(1, h)], [y, 1]]) { // |across - middle| <= (distance + deep) t share
      const near = s => Math.max(...this.points.map(p => s * V.dot(axis, V.sub(p, camera.target)) / (t * share) - V.dot(z, V.sub(p, camera.target))));
      const right = near(1), left = near(-1);
      camera.target = V.add(camera.target, axis, (right - left) / 2 * t * share);
      camera.distance = Math.max(axis === x ? 0 : camera.distance, (right + left) / 2);
    }
  }
  eye(distance = this.camera.distance) {
    const {yaw, pitch, target} = this.camera;
    return V.add(target, [Math.cos(yaw) * Math.cos(pitch), Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch)], distance);
  }
  draw() {
    const gl = this.gl, canvas = this.canvas, ratio = Math.min(devicePixelRatio || 1, 2);
    if (!gl) return;
    const wide = Math.round(canvas.clientWidth * ratio), high = Math.round(canvas.clientHeight * ratio);
    if (!wide || !high) return;
    if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
    const eye = this.eye(), d = this.camera.distance;
    this.view = M.times(M.perspective(FOV, wide / high, d / 50, d * 12), M.look(eye, this.camera.target, [0, 0, 1]));
    gl.viewport(0, 0, wide, high); gl.clearColor(0, 0, 0, 0); gl.clearStencil(0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST); gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(this.solid.program);
    gl.uniformMatrix4fv(this.solid.v, false, this.view);
    gl.uniform3fv(this.solid.e, eye); gl.uniform3fv(this.solid.l, LIGHT);
    const ink = colour("--ink"), accent = colour("--c1"), edge = colour("--edge");
    this.grid(ink);
    if (this.joints.length) {
      this.shadow();
      for (const shape of this.shapes) for (const part of shape.parts)
        this.body(part.kind, M.times(this.joints[shape.joint], part.matrix), [...shape.colour.map(lighter), 1]);
    }
    if (this.framed) for (const b of this.boxes) this.segments(this.edges(b), [...edge, .75]);
    if (this.grips.length) { // in front of the machine that surrounds it
      gl.depthRange(0, .02);
      const size = this.extent * .022;
      gl.depthMask(false); // the twin's place is seen around the grip, and hides nothing
      for (const place of this.twin) this.body("sphere", ballAt(place, size * 1.5), [...colour("--c3"), .38]);
      gl.depthMask(true);
      this.grips.forEach((grip, i) => {
        this.body("sphere", ballAt(grip, size * (this.grabbed || this.hover ? 1.5 : 1)), [...accent, 1]);
        this.arrow(grip, this.wrenches[2 * i]);
      });
      this.ellipsoid(this.grips[0], this.strength, colour("--c4"));
      for (const force of this.reachable) {
        const end = V.add(this.grips[0], this.drawn(force));
        this.segments([this.grips[0], end], [...colour("--c4"), 1]); this.body("sphere", ballAt(end, size * .55), [...colour("--c4"), 1]);
      }
      if (this.grabbed) this.segments([this.grips[this.grabbed.grip], this.grabbed.place], [...accent, 1]);
      gl.depthRange(0, 1);
    }
    gl.depthMask(false);
    for (const p of this.planes) if (this.framed) this.plane(p, colour("--c2"));
    gl.depthMask(true);
  }
  body(kind, m, c, lit = 1) {
    const gl = this.gl, mesh = this.meshes[kind];
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.buffer);
    gl.enableVertexAttribArray(0); gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 24, 0); gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 24, 12);
    gl.uniformMatrix4fv(this.solid.m, false, m);
    gl.uniformMatrix3fv(this.solid.q, false, normals(m));
    gl.uniform4fv(this.solid.c, c); gl.uniform1f(this.solid.lit, lit);
    gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
  }
  shadow() { // every pixel of the floor once, however many parts are above it
    const gl = this.gl, [x, y, z] = LIGHT, f = this.floor + .002 * this.extent;
    const flat = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, -x / z, -y / z, 0, 0, f * x / z, f * y / z, f, 1]);
    gl.enable(gl.STENCIL_TEST); gl.stencilFunc(gl.EQUAL, 0, 255); gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    for (const shape of this.shapes) for (const part of shape.parts)
      this.body(part.kind, M.times(flat, M.times(this.joints[shape.joint], part.matrix)), [0, 0, 0, .16], 0);
    gl.depthMask(true); gl.disable(gl.STENCIL_TEST);
  }
  segments(points, c, kind = this.gl.LINES) {
    const gl = this.gl, data = new Float32Array(points.length * 6);
    points.forEach((p, i) => { data.set(p, 6 * i); data[6 * i + 5] = 1; });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lines); gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(0); gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 24, 0); gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 24, 12);
    gl.uniformMatrix4fv(this.solid.m, false, M.pose([0, 0, 0, 0, 0, 0, 1]));
    gl.uniformMatrix3fv(this.solid.q, false, [1, 0, 0, 0, 1, 0, 0, 0, 1]);
    gl.uniform4fv(this.solid.c, c); gl.uniform1f(this.solid.lit, 0);
    gl.drawArrays(kind, 0, points.length);
  }
  grid(ink) {
    const reach = this.extent * 1.7, step = [.05, .1, .25, .5, 1, 2].find(s => reach / s < 14) || 5;
    const [cx, cy] = this.camera.target.map(v => Math.round(v / step) * step), n = Math.ceil(reach / step), points = [];
    for (let i = -n; i <= n; i++) {
      const h = Math.sqrt(Math.max(0, n * n - i * i)) * step;
      points.push([cx + i * step, cy - h, this.floor], [cx + i * step, cy + h, this.floor], [cx - h, cy + i * step, this.floor], [cx + h, cy + i * step, this.floor]);
    }
    this.segments(points, [...ink, .13]); this.step = step;
  }
  edges(box) { // of its faces, in pairs of ends; a side that is open has no face, and the others end with the machine
    const ends = [box.lower, box.upper], open = [this.lower, this.upper], points = [];
    const corner = k => [0, 1, 2].map(i => ends[k >> i & 1][i] ?? open[k >> i & 1][i]);
    for (let k = 0; k < 8; k++) for (let i = 0; i < 3; i++) {
      const faces = [0, 1, 2].filter(j => j !== i && ends[k >> j & 1][j] !== null);
      if (!(k >> i & 1) && faces.length) points.push(corner(k), corner(k | 1 << i));
    }
    return points;
  }
  sides(p) { // two vectors from the middle of what is drawn of a plane
    const r = this.extent * .55, z = p.normal, x = V.unit(V.cross(Math.abs(z[2]) < .9 ? [0, 0, 1] : [1, 0, 0], z));
    return [V.scale(x, r), V.scale(V.cross(z, x), r * .6)];
  }
  corners(p) {
    const [x, y] = this.sides(p);
    return [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => V.add(V.add(p.point, x, a), y, b));
  }
  plane(p, c) {
    const around = this.corners(p);
    this.body("quad", M.axes(...this.sides(p), p.normal, p.point), [...c, .28], 0);
    this.segments(around.flatMap((from, i) => [from, around[(i + 1) % 4]]), [...c, .8]);
  }
  drawn(force) { // the stronger, the longer, and never out of the picture
    return V.scale(V.unit(force), this.extent * .5 * (1 - Math.exp(-V.size(force) / this.newtons)));
  }
  ellipsoid(centre, semi, c) { // of forces that the motors can hold: one that is drawn beyond it is too strong
    for (let i = 0; i < semi.length; i++) for (let j = 0; j < i; j++) {
      const round = t => V.add(centre, this.drawn(V.add(V.scale(semi[i], Math.cos(t)), semi[j], Math.sin(t)))), points = [];
      for (let k = 0; k < 72; k++) points.push(round(k * Math.PI / 36), round((k + 1) * Math.PI / 36));
      this.segments(points, [...c, .95]);
      this.gl.depthMask(false);
      this.segments(points.flatMap((p, k) => k % 2 ? [p] : [centre, p]), [...c, 1.2 / semi.length ** 2], this.gl.TRIANGLES); // three hide what two do
      this.gl.depthMask(true);
    }
  }
  arrow(grip, force) { // of a hand on the machine
    if (V.size(force) < .5) return;
    const way = this.drawn(force), thick = this.extent * .008, c = [...colour("--c2"), 1];
    this.body("cylinder", M.times(M.along(grip, V.scale(way, .8), thick), M.axes([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, .5])), c);
    this.body("cone", M.along(V.add(grip, way, .78), V.scale(way, .22), thick * 2.6), c);
  }
  seen(p) { // on the canvas, in CSS pixels
    const [x, y, , w] = M.point(this.view, p);
    return w > 0 ? [(x + 1) / 2 * this.canvas.clientWidth, (1 - y) / 2 * this.canvas.clientHeight] : null;
  }
  ray(x, y) {
    const {clientWidth: w, clientHeight: h} = this.canvas, eye = this.eye(), z = V.unit(V.sub(this.camera.target, eye));
    const right = V.unit(V.cross(z, [0, 0, 1])), up = V.cross(right, z), t = Math.tan(FOV / 2);
    return [eye, V.unit(V.add(V.add(z, right, (2 * x / w - 1) * t * w / h), up, (1 - 2 * y / h) * t))];
  }
  pointers() {
    const canvas = this.canvas, down = new Map();
    const at = event => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    const away = (grip, p) => { const s = this.seen(grip); return s ? Math.hypot(s[0] - p[0], s[1] - p[1]) : Infinity; };
    const near = p => this.view && this.grips.filter(grip => away(grip, p) < 30).sort((a, b) => away(a, p) - away(b, p))[0];
    const drop = event => { down.delete(event.pointerId); if (this.grabbed?.id === event.pointerId) this.grabbed = null; this.draw(); };
    canvas.addEventListener("pointerdown", event => {
      canvas.setPointerCapture(event.pointerId); down.set(event.pointerId, at(event));
      const grip = near(at(event));
      if (down.size === 1 && this.onlead && grip) { // led is the middle between the hands: all go the way of the one
        const eye = this.eye(), middle = V.scale(this.grips.reduce((a, b) => V.add(a, b)), 1 / this.grips.length);
        this.grabbed = {id: event.pointerId, grip: this.grips.indexOf(grip), place: grip, origin: grip, middle: V.sub(middle, grip), normal: V.unit(V.sub(this.camera.target, eye))};
      }
    });
    canvas.addEventListener("pointermove", event => {
      const p = at(event), before = down.get(event.pointerId);
      if (!before) { this.hover = this.onlead && !!near(p); canvas.style.cursor = this.hover ? "grab" : ""; return; }
      down.set(event.pointerId, p);
      if (this.grabbed?.id === event.pointerId) {
        const [eye, way] = this.ray(...p), {origin, normal} = this.grabbed, across = V.dot(way, normal);
        if (Math.abs(across) > 1e-3) { this.grabbed.place = V.add(eye, way, V.dot(V.sub(origin, eye), normal) / across); this.onlead(V.add(this.grabbed.place, this.grabbed.middle)); }
      } else if (down.size === 2) {
        const other = [...down].find(([id]) => id !== event.pointerId)[1];
        this.camera.distance *= Math.hypot(before[0] - other[0], before[1] - other[1]) / Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
      } else if (event.shiftKey || event.buttons & 2) {
        const [, way] = this.ray(canvas.clientWidth / 2, canvas.clientHeight / 2), right = V.unit(V.cross(way, [0, 0, 1])), up = V.cross(right, way), s = this.camera.distance / canvas.clientHeight * .63;
        this.camera.target = V.add(V.add(this.camera.target, right, (before[0] - p[0]) * s), up, (p[1] - before[1]) * s);
      } else {
        this.camera.yaw -= (p[0] - before[0]) * .007;
        this.camera.pitch = Math.max(-.2, Math.min(1.5, this.camera.pitch + (p[1] - before[1]) * .007));
      }
      this.draw();
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(name, drop);
    canvas.addEventListener("contextmenu", event => event.preventDefault());
    canvas.addEventListener("wheel", event => { event.preventDefault(); this.camera.distance *= Math.exp(event.deltaY * .001); this.draw(); }, {passive: false});
    canvas.addEventListener("dblclick", () => { this.frameAll(); this.draw(); });
  }
}
const NEWTONS = 40; // of a force that is drawn 63 % as long as any can be
const FOV = .6, FILLED = .86; // of the picture, by a machine as it stands when it is framed
const CORNERS = [...Array(8).keys()].map(k => [0, 1, 2].map(i => k >> i & 1 ? 1 : -1)), LIGHT = V.unit([.35, -.45, .9]);
const threes = list => list.flatMap((_, i) => i % 3 ? [] : [list.slice(i, i + 3)]);
const lighter = c => .08 + .92 * c;
const ballAt = (p, r) => M.axes([r, 0, 0], [0, r, 0], [0, 0, r], p);
function normals(m) { // columns over the squares of their sizes: right for stretched bodies
  const out = new Float32Array(9);
  for (let c = 0; c < 3; c++) {
    const s = m[4 * c] ** 2 + m[4 * c + 1] ** 2 + m[4 * c + 2] ** 2 || 1;
    for (let r = 0; r < 3; r++) out[3 * c + r] = m[4 * c + r] / s;
  }
  return out;
}
function parts(shape) { // a shape of unit bodies
  const m = M.pose(shape.pose), [a, b] = shape.size;
  if (shape.kind === "box") return [{kind: "box", matrix: M.stretched(m, shape.size)}];
  if (shape.kind === "sphere") return [{kind: "sphere", matrix: M.stretched(m, [a, a, a])}];
  const tube = {kind: "cylinder", matrix: M.stretched(m, [a, a, b])};
  if (shape.kind === "cylinder") return [tube];
  const end = s => ({kind: "sphere", matrix: M.stretched(M.times(m, M.axes([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, s * b / 2])), [a, a, a])});
  return [tube, end(-1), end(1)];
}
function box() {
  const points = [], normal = [];
  for (let axis = 0; axis < 3; axis++) for (const s of [-1, 1]) {
    const u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
      const p = [0, 0, 0], n = [0, 0, 0]; p[axis] = s / 2; p[u] = a / 2; p[v] = b / 2; n[axis] = s; points.push(...p); normal.push(...n);
    }
  }
  return [points, normal];
}
function turned(profile, closed, sides = 28) { // a profile of (radius, height, slope) about z
  const points = [], normal = [], put = (r, h, t, n) => { points.push(r * Math.cos(t), r * Math.sin(t), h); normal.push(...n); };
  for (let i = 0; i < sides; i++) {
    const a = 2 * Math.PI * i / sides, b = 2 * Math.PI * (i + 1) / sides;
    const out = (t, s) => V.unit([Math.cos(t), Math.sin(t), s]);
    const [[r0, h0, s0], [r1, h1]] = profile;
    put(r0, h0, a, out(a, s0)); put(r0, h0, b, out(b, s0)); put(r1, h1, b, out(b, s0));
    put(r0, h0, a, out(a, s0)); put(r1, h1, b, out(b, s0)); put(r1, h1, a, out(a, s0));
    if (closed) for (const [r, h, s] of [[r0, h0, -1], [r1, h1, 1]]) { put(0, h, 0, [0, 0, s]); put(r, h, a, [0, 0, s]); put(r, h, b, [0, 0, s]); }
  }
  return [points, normal];
}
function ball(rows = 12, columns = 20) {
  const points = [], at = (i, j) => { const t = Math.PI * i / rows, f = 2 * Math.PI * j / columns; return [Math.sin(t) * Math.cos(f), Math.sin(t) * Math.sin(f), Math.cos(t)]; };
  for (let i = 0; i < rows; i++) for (let j = 0; j < columns; j++)
    for (const [a, b] of [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]]) points.push(...at(i + a, j + b));
  return [points, points];
}
function quad() {
  const points = [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, -1, 0, 1, 1, 0, -1, 1, 0];
  return [points, points.map((_, i) => i % 3 === 2 ? 1 : 0)];
}
let palette = {};
function colour(name) { // of the page's scheme, 0 to 1
  return palette[name] ??= (text => [1, 3, 5].map(i => parseInt((text.length < 6 ? text.replace(/[^#]/g, "$&$&") : text).slice(i, i + 2), 16) / 255))(
    getComputedStyle(document.documentElement).getPropertyValue(name).trim());
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { palette = {}; });
