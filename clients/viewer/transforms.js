// SPDX-License-Identifier: MIT
// Vectors and matrices of nodes. Matrices are affine, 16 numbers, column-major; "parent from node"
// read right to left, as the service has them.

export const IDENTITY = Object.freeze([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);

export const AXES = Object.freeze([[1, 0, 0], [0, 1, 0], [0, 0, 1]]);

const DEG = 180 / Math.PI;

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const add = (a, b, scale = 1) => a.map((value, axis) => value + scale * b[axis]);
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const clamp = (value, least, most) => Math.min(most, Math.max(least, value));

/** The vector at length 1; null when it has none. */
export function unit(vector) {
  const length = Math.hypot(...vector);
  return length > 0 ? vector.map((value) => value / length) : null;
}

/** Two unit vectors that stand on a unit vector and on each other. */
export function frameOf(normal) {
  const least = normal.map(Math.abs).indexOf(Math.min(...normal.map(Math.abs)));
  const u = unit(cross(normal, [0, 1, 2].map((axis) => (axis === least ? 1 : 0))));
  return [u, cross(normal, u)];
}

const column = (matrix, at) => matrix.slice(4 * at, 4 * at + 3);
const fromColumns = (columns, translation) =>
  [...columns.flatMap((own) => [...own, 0]), ...translation, 1];

/** A direction through a matrix: without its translation. */
export const turned = (matrix, vector) => [0, 1, 2].map((row) =>
  matrix[row] * vector[0] + matrix[4 + row] * vector[1] + matrix[8 + row] * vector[2]);

/** A point through a matrix. */
export const moved = (matrix, point) => add(turned(matrix, point), matrix.slice(12, 15));

/** What does b first, then a. */
export const multiply = (a, b) =>
  fromColumns([0, 1, 2].map((at) => turned(a, column(b, at))), moved(a, b.slice(12, 15)));

export function inverse(matrix) {
  const [a, b, c] = [0, 1, 2].map((at) => column(matrix, at));
  const rows = [cross(b, c), cross(c, a), cross(a, b)].map((row) =>
    row.map((value) => value / dot(a, cross(b, c))));
  const linear = fromColumns([0, 1, 2].map((at) => rows.map((row) => row[at])), [0, 0, 0]);
  const back = turned(linear, matrix.slice(12, 15));
  return fromColumns([0, 1, 2].map((at) => column(linear, at)), back.map((value) => -value));
}

/** The middle of a box: least x y z, greatest x y z. */
export const middleOf = (bounds) => [0, 1, 2].map((axis) => (bounds[axis] + bounds[axis + 3]) / 2);

/**
 * The box around a box that went through a matrix; boxes are least x y z, greatest x y z.
 */
export function movedBounds(matrix, bounds) {
  const corners = Array.from({ length: 8 }, (_, corner) =>
    moved(matrix, [0, 1, 2].map((axis) => bounds[axis + 3 * ((corner >> axis) & 1)])));
  return [0, 1, 2].map((axis) => Math.min(...corners.map((corner) => corner[axis])))
    .concat([0, 1, 2].map((axis) => Math.max(...corners.map((corner) => corner[axis]))));
}

/** Gram and Schmidt's rotation of a matrix, as three columns, and the scales along them; a mirror
 * is a negative first scale. */
function rotationAndScale(matrix) {
  const [a, b, c] = [0, 1, 2].map((at) => column(matrix, at));
  let x = unit(a);
  const y = unit(add(b, x, -dot(x, b)));
  const z = unit(add(add(c, x, -dot(x, c)), y, -dot(y, c)));
  if (dot(x, cross(y, z)) < 0) x = x.map((value) => -value);
  return { axes: [x, y, z], scale: [dot(x, a), dot(y, b), dot(z, c)] };
}

/**
 * A matrix as people say it: translation; rotation in degrees about the fixed axes X, then Y, then
 * Z; scale along the node's own axes.
 */
export function decompose(matrix) {
  const { axes: [x, y, z], scale } = rotationAndScale(matrix);
  const tilt = Math.asin(clamp(-x[2], -1, 1));
  const isUpright = Math.abs(x[2]) > 1 - 1e-12; // X and Z turn about one axis: all of it is X's
  const rotation = isUpright ? [Math.atan2(-z[1], y[1]), tilt, 0]
    : [Math.atan2(y[2], z[2]), tilt, Math.atan2(x[1], x[0])];
  return { translation: matrix.slice(12, 15), scale,
    rotation: rotation.map((angle) => angle * DEG) };
}

/** Sine and cosine of degrees, exact at quarters of a turn. */
function sinCos(degrees) {
  const quarter = degrees / 90;
  if (!Number.isInteger(quarter)) return [Math.sin(degrees / DEG), Math.cos(degrees / DEG)];
  return [[0, 1], [1, 0], [0, -1], [-1, 0]][((quarter % 4) + 4) % 4];
}

/** The columns of a rotation in degrees about X, then Y, then Z. */
function axesOf(rotation) {
  const [[sx, cx], [sy, cy], [sz, cz]] = rotation.map(sinCos);
  return [[cz * cy, sz * cy, -sy],
    [cz * sy * sx - sz * cx, sz * sy * sx + cz * cx, cy * sx],
    [cz * sy * cx + sz * sx, sz * sy * cx - cz * sx, cy * cx]];
}

export const withTranslation = (matrix, translation) =>
  [...matrix.slice(0, 12), ...translation, 1];

/** The same linear map about a point, which stays where it is. */
const about = (linear, point) => withTranslation(linear, add(point, turned(linear, point), -1));

/** A turn about a unit axis through a point, counter-clockwise seen against the axis. */
export function turnAbout(axis, degrees, point = [0, 0, 0]) {
  const [sin, cos] = sinCos(degrees); // Rodrigues' formula, column by column
  const columns = [0, 1, 2].map((at) => {
    const own = [0, 1, 2].map((row) => (row === at ? 1 : 0));
    const turnedOwn = add(own.map((value) => value * cos), cross(axis, own), sin);
    return add(turnedOwn, axis, axis[at] * (1 - cos));
  });
  return about(fromColumns(columns, [0, 0, 0]), point);
}

/** All of space nearer to a point, or farther from it, by a factor. */
export const scaleAbout = (factor, point) =>
  about(fromColumns([[factor, 0, 0], [0, factor, 0], [0, 0, factor]], [0, 0, 0]), point);

/** Turned to this rotation; scale and shear stay. */
export function withRotation(matrix, rotation) {
  const { axes } = rotationAndScale(matrix);
  const to = axesOf(rotation);
  const turn = (vector) => [0, 1, 2].reduce((sum, at) => add(sum, to[at], dot(axes[at], vector)), [0, 0, 0]);
  return fromColumns([0, 1, 2].map((at) => turn(column(matrix, at))), matrix.slice(12, 15));
}

/** Scaled to these; null where one of them is 0, which no node can be. */
export function withScale(matrix, scale) {
  if (scale.some((value) => !(Math.abs(value) > 1e-9))) return null;
  const before = rotationAndScale(matrix).scale;
  return fromColumns([0, 1, 2].map((at) =>
    column(matrix, at).map((value) => (value * scale[at]) / before[at])), matrix.slice(12, 15));
}
