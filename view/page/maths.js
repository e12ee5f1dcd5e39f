// Vectors as arrays of three, matrices of 4 x 4 by columns, as WebGL has them.
"use strict";
const V = {
  add: (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]],
  sub: (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]],
  scale: (a, s) => [a[0] * s, a[1] * s, a[2] * s],
  dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
  cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
  size: a => Math.hypot(a[0], a[1], a[2]),
  unit: a => V.scale(a, 1 / (V.size(a) || 1)),
};
const M = {
  times(a, b) {
    const m = new Float32Array(16);
    for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++)
      m[4 * c + r] = a[r] * b[4 * c] + a[4 + r] * b[4 * c + 1] + a[8 + r] * b[4 * c + 2] + a[12 + r] * b[4 * c + 3];
    return m;
  },
  point: (m, p) => {
    const w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
    return [0, 1, 2].map(r => (m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]) / w).concat(w);
  },
  pose(p, at = 0) { // position and quaternion (x, y, z, w)
    const [x, y, z, i, j, k, r] = p.slice(at, at + 7);
    return new Float32Array([1 - 2 * (j * j + k * k), 2 * (i * j + k * r), 2 * (i * k - j * r), 0,
      2 * (i * j - k * r), 1 - 2 * (i * i + k * k), 2 * (j * k + i * r), 0,
      2 * (i * k + j * r), 2 * (j * k - i * r), 1 - 2 * (i * i + j * j), 0, x, y, z, 1]);
  },
  axes: (x, y, z, p) => new Float32Array([...x, 0, ...y, 0, ...z, 0, ...p, 1]),
  stretched: (m, s) => m.map((v, i) => i < 12 ? v * s[i >> 2] : v),
  along(from, way, radius) { // unit z onto way, as long as it
    const z = V.unit(way), x = V.unit(V.cross(Math.abs(z[2]) < .9 ? [0, 0, 1] : [1, 0, 0], z));
    return M.axes(V.scale(x, radius), V.scale(V.cross(z, x), radius), way, from);
  },
  perspective(fov, aspect, near, far) {
    const f = 1 / Math.tan(fov / 2);
    return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0]);
  },
  look(eye, to, up) {
    const z = V.unit(V.sub(eye, to)), x = V.unit(V.cross(up, z)), y = V.cross(z, x);
    return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -V.dot(x, eye), -V.dot(y, eye), -V.dot(z, eye), 1]);
  },
};
