// SPDX-License-Identifier: MIT
// Lights as members of a view: what each type has, new ones, and which way they stand.
import { angleAbout, circle } from "./gizmo_math.js";
import { add, cross, dot, frameOf, turnAbout, turned, unit } from "./transforms.js";

export const TYPES = ["point", "spot", "directional", "rect", "disk"];

const MEMBERS_OF_TYPE = {
  point: ["position", "range"],
  spot: ["position", "direction", "range", "inner_cone_deg", "outer_cone_deg", "up"],
  directional: ["direction", "up"],
  rect: ["position", "direction", "width", "height", "up"],
  disk: ["position", "direction", "radius"],
};
const DEFAULT_MEMBERS = {
  position: [0, 0, 0], direction: [0, -1, 0], width: 1, height: 1, radius: 0.5,
};
const ALWAYS_SAID = ["position", "direction", "width", "height", "radius"]; // the service needs them

/** Only the members that a light of its type has: others would be refused. */
export function lightMembers(light) {
  const kept = { type: light.type };
  for (const name of ["color", "intensity", "shadow", ...MEMBERS_OF_TYPE[light.type]]) {
    if (light[name] !== undefined) kept[name] = light[name];
    else if (ALWAYS_SAID.includes(name)) kept[name] = DEFAULT_MEMBERS[name];
  }
  if (kept.up && Math.hypot(...cross(kept.up, kept.direction)) < 1e-6) delete kept.up; // says nothing
  return kept;
}

/**
 * A new light where it is seen to shine: before what the camera looks at, a quarter of the way back
 * to the eye and a little above, and turned to it. Its intensity gives about 3 lx there, as much as
 * a bright room.
 * @param {{target: number[], eye: number[], up: number[], distance: number}} camera
 */
export function newLight(type, { target, eye, up, distance }) {
  const short = (value) => Number(value.toPrecision(3));
  const way = distance / 4;
  const unitOfLength = 10 ** Math.floor(Math.log10(way) - 2); // three digits, also far from the origin
  const place = add(add(target, add(eye, target, -1), 0.25), up, 0.5 * way)
    .map((value) => Math.round(value / unitOfLength) * unitOfLength)
    .map((value) => Number(value.toPrecision(12)));
  const side = short(0.5 * way);
  const candela = short(3 * 1.25 * way ** 2); // the square of the way to the target
  const intensity = { directional: 3, rect: short(candela / side ** 2),
    disk: short((4 * candela) / (Math.PI * side ** 2)) }[type] ?? candela;
  return lightMembers({
    type, intensity, color: [1, 1, 1], width: side, height: side, radius: side / 2,
    position: place,
    direction: type === "directional" ? [-0.4, -1, -0.3] : tidy(add(target, place, -1)),
  });
}

// ---- which way a light stands ----

/** The way that is up on a rectangle, where the service gets none: +Y, or -Z for one that
 * shines straight up or down; across its direction. */
function restingUp(normal) {
  const wanted = Math.hypot(normal[0], normal[2]) > 0 ? [0, 1, 0] : [0, 0, -1];
  return unit(add(wanted, normal, -dot(wanted, normal))) ?? frameOf(normal)[0];
}

/** Unit vectors of a light that shines somewhere: {normal, up}, up across its direction. */
export function lightFrame({ direction, up }) {
  const normal = unit(direction);
  const across = up && unit(add(up, normal, -dot(up, normal)));
  return { normal, up: across ?? restingUp(normal) };
}

const tidy = (way) => unit(way).map((value) => Number(value.toFixed(12)) || 0);

/** Direction and up after a turn about an axis of the world. */
export function turnedLight(light, axis, degrees) {
  const spin = turnAbout(axis, degrees);
  const { normal, up } = lightFrame(light);
  const members = { direction: tidy(turned(spin, normal)) };
  if (light.type === "rect" || light.up) members.up = tidy(turned(spin, up));
  return members;
}

/** Degrees about the direction by which a rectangle's up is away from where it is by itself. */
export function rollOf(light) {
  const { normal, up } = lightFrame(light);
  return Number(angleAbout(normal, restingUp(normal), up).toFixed(6)) || 0;
}

/** The member that rolls a rectangle so far. */
export function rolled(light, degrees) {
  const { normal } = lightFrame(light);
  return { up: tidy(turned(turnAbout(normal, degrees), restingUp(normal))) };
}

/** What an area light covers, as a closed line in the world. */
function areaOutline(light) {
  const { type, position, width, height, radius } = light;
  const { normal, up: y } = lightFrame(light);
  if (type === "disk") return circle(position, normal, radius);
  const x = cross(y, normal);
  return [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]].map(([a, b]) =>
    add(add(position, x, (a * width) / 2), y, (b * height) / 2));
}

/** Lines in the world that show what a light reaches, at a distance from it. */
export function lightOutlines(light, distance) {
  if (light.type === "rect" || light.type === "disk") return [areaOutline(light)];
  if (light.type !== "spot") return [];
  const axis = unit(light.direction);
  return [light.outer_cone_deg ?? 45, light.inner_cone_deg ?? 0].filter((angle) => angle > 0)
    .flatMap((angle, at) => {
      const [sin, cos] = [Math.sin(angle * Math.PI / 180), Math.cos(angle * Math.PI / 180)];
      const rim = circle(add(light.position, axis, distance * cos), axis, distance * sin);
      const rays = at > 0 ? [] : [0, 12, 24, 36].map((i) => [light.position, rim[i]]);
      return [rim, ...rays];
    });
}
