// SPDX-License-Identifier: MIT
// The geometry behind the handles: rays against lines, planes and spheres, angles and circles.
import { add, cross, dot, frameOf, unit } from "./transforms.js";

const CIRCLE_POINTS = 48;
const DEG = 180 / Math.PI;

/** Where on the line through a point along a unit axis a ray comes nearest, in metres; null when
 * they are parallel. */
export function nearestOnAxis(point, axis, { origin, direction }) {
  const along = dot(axis, direction);
  const offset = add(point, origin, -1);
  const apart = 1 - along * along;
  return apart < 1e-6 ? null : (along * dot(direction, offset) - dot(axis, offset)) / apart;
}

/** Where a ray meets the plane through a point; null when it never does. */
export function onPlane(point, normal, { origin, direction }) {
  const along = dot(normal, direction);
  if (Math.abs(along) < 1e-6) return null;
  return add(origin, direction, dot(normal, add(point, origin, -1)) / along);
}

/** The direction from a centre to where a ray meets its sphere, on the side that is nearer to
 * `before`; where it misses, to where it comes nearest. */
export function onSphere(center, radius, before, { origin, direction }) {
  const offset = add(origin, center, -1);
  const along = dot(offset, direction);
  const inside = along * along - dot(offset, offset) + radius * radius;
  const root = Math.sqrt(Math.max(0, inside));
  const found = [-along - root, -along + root].map((t) => unit(add(offset, direction, t)))
    .filter(Boolean).sort((a, b) => dot(b, before) - dot(a, before));
  return found[0] ?? null;
}

/** Degrees about a unit axis from one direction to another, counter-clockwise seen against the
 * axis, from -180 to 180; what lies along the axis does not count. */
export function angleAbout(axis, from, to) {
  const [a, b] = [from, to].map((way) => add(way, axis, -dot(axis, way)));
  return Math.atan2(dot(axis, cross(a, b)), dot(a, b)) * DEG;
}

/** Points of an arc about an axis: from a direction on, over so many degrees. */
export function arc(center, axis, from, degrees, radius) {
  const across = cross(axis, from);
  const count = Math.max(2, Math.ceil(Math.abs(degrees) / 6));
  return Array.from({ length: count + 1 }, (_, i) => {
    const angle = (degrees * i) / count / DEG;
    return add(add(center, from, radius * Math.cos(angle)), across, radius * Math.sin(angle));
  });
}

/** A circle in the world. */
export const circle = (center, normal, radius) => {
  const [u, v] = frameOf(normal);
  return Array.from({ length: CIRCLE_POINTS + 1 }, (_, i) => {
    const angle = (2 * Math.PI * i) / CIRCLE_POINTS;
    return add(add(center, u, radius * Math.cos(angle)), v, radius * Math.sin(angle));
  });
};
