// SPDX-License-Identifier: MIT
// Handles over the picture: what can be moved has three axes and a middle, what shines somewhere a
// ball to aim it by. They are for the pointer; the same values are fields in the panels.
import { byId } from "./dom.js";
import { add, cross, dot, frameOf, unit } from "./transforms.js";

const SVG = "http://www.w3.org/2000/svg";
const ARM_PX = 74; // of the axes
const AIM_PX = 118; // of the way to the ball
const SHORT_PX = 14; // an axis that is seen shorter points at us and cannot be dragged
const CIRCLE_POINTS = 48;
const AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const NAMES = ["x", "y", "z"];

function node(parent, tag, className) {
  const made = document.createElementNS(SVG, tag);
  made.setAttribute("class", className);
  parent.append(made);
  return made;
}

const set = (element, attributes) => {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
};

/** Where on the line through a point along a unit axis a ray comes nearest, in metres; null when
 * they are parallel. */
function nearestOnAxis(point, axis, { origin, direction }) {
  const along = dot(axis, direction);
  const offset = add(point, origin, -1);
  const apart = 1 - along * along;
  return apart < 1e-6 ? null : (along * dot(direction, offset) - dot(axis, offset)) / apart;
}

/** Where a ray meets the plane through a point; null when it never does. */
function onPlane(point, normal, { origin, direction }) {
  const along = dot(normal, direction);
  if (Math.abs(along) < 1e-6) return null;
  return add(origin, direction, dot(normal, add(point, origin, -1)) / along);
}

/** The direction from a centre to where a ray meets its sphere, on the side that is nearer to
 * `before`; where it misses, to where it comes nearest. */
function onSphere(center, radius, before, { origin, direction }) {
  const offset = add(origin, center, -1);
  const along = dot(offset, direction);
  const inside = along * along - dot(offset, offset) + radius * radius;
  const root = Math.sqrt(Math.max(0, inside));
  const found = [-along - root, -along + root].map((t) => unit(add(offset, direction, t)))
    .filter(Boolean).sort((a, b) => dot(b, before) - dot(a, before));
  return found[0] ?? null;
}

/** A circle in the world. */
const circle = (center, normal, radius) => {
  const [u, v] = frameOf(normal);
  return Array.from({ length: CIRCLE_POINTS + 1 }, (_, i) => {
    const angle = (2 * Math.PI * i) / CIRCLE_POINTS;
    return add(add(center, u, radius * Math.cos(angle)), v, radius * Math.sin(angle));
  });
};

/** What an area light covers, as a closed line in the world. */
function areaOutline({ type, position, direction, up, width, height, radius }) {
  const normal = unit(direction);
  if (type === "disk") return circle(position, normal, radius);
  const wanted = up ?? (Math.hypot(direction[0], direction[2]) > 0 ? [0, 1, 0] : [0, 0, -1]);
  const y = unit(add(wanted, normal, -dot(wanted, normal))) ?? frameOf(normal)[0];
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

/**
 * @typedef {object} Target what the handles hold
 * @property {number[]} position in the world
 * @property {number[]} [along] unit: moved along it alone, instead of along the axes of the world
 * @property {number[]} [direction] with a ball to aim it by
 * @property {(distance: number) => number[][][]} [outlines] lines to show with it
 * @property {(position: number[]) => void} [move] absent: it cannot be moved
 * @property {(direction: number[]) => void} [aim]
 */
export class Gizmo {
  #held = null; // what is being dragged: {pointer, drag}

  /**
   * @param {() => Target|null} target
   * @param {() => {position: number[], color: string, name: string, choose: () => void}[]} dots
   */
  constructor(stage, model, { target, dots }) {
    Object.assign(this, { stage, model, target, dots });
    this.root = byId("gizmo");
    this.lines = node(this.root, "path", "gizmo-outline");
    this.dotLayer = node(this.root, "g", "gizmo-dots");
    this.stem = node(this.root, "line", "gizmo-stem");
    this.axes = NAMES.map((name, i) => this.#axis(name, () => AXES[i]));
    this.along = this.#axis("n", () => this.target()?.along);
    this.center = this.#handle("circle", "gizmo-center", 8, (ray) => this.#dragPlane(ray));
    this.ball = this.#handle("circle", "gizmo-ball", 8, (ray) => this.#dragBall(ray));
  }

  /** An arm to drag along an axis, which is asked for when it is grabbed. */
  #axis(name, axisOf) {
    const arm = node(this.root, "g", `gizmo-axis gizmo-${name}`);
    const parts = { arm, line: node(arm, "line", "gizmo-line"), tip: node(arm, "circle", "gizmo-tip"),
      reach: node(arm, "line", "gizmo-reach") };
    parts.tip.setAttribute("r", 5);
    arm.dataset.handle = name;
    this.#listen(arm, (ray) => this.#dragAxis(axisOf(), ray));
    return { ...parts, axisOf };
  }

  #handle(tag, className, radius, grab) {
    const group = node(this.root, "g", className);
    group.dataset.handle = className.split("-")[1];
    const [seen, reach] = [node(group, tag, "gizmo-tip"), node(group, tag, "gizmo-reach")];
    seen.setAttribute("r", radius);
    reach.setAttribute("r", 4);
    this.#listen(group, grab);
    return { group, circles: [seen, reach] };
  }

  // ---- dragging ----

  #rayOf(event) {
    return this.model.camera.rayAt(this.stage.shareOf(event), this.stage.aspect);
  }

  /** grab answers what to do with the rays of the moves that follow, or null. */
  #listen(element, grab) {
    element.addEventListener("pointerdown", (event) => {
      event.stopPropagation(); // the picture stays where it is
      if (event.button !== 0 || this.#held) return;
      const drag = grab(this.#rayOf(event));
      if (!drag) return;
      element.setPointerCapture(event.pointerId);
      this.#held = { pointer: event.pointerId, drag };
      this.root.dataset.held = element.dataset.handle;
    });
    element.addEventListener("pointermove", (event) => {
      if (this.#held?.pointer !== event.pointerId) return;
      event.stopPropagation();
      this.#held.drag(this.#rayOf(event));
    });
    for (const type of ["pointerup", "pointercancel"])
      element.addEventListener(type, (event) => {
        event.stopPropagation();
        if (this.#held?.pointer !== event.pointerId) return;
        this.#held = null;
        delete this.root.dataset.held;
      });
    element.addEventListener("dblclick", (event) => event.stopPropagation());
  }

  /** Metres to the power of ten that a pixel can tell apart at a point, and the digits of that. */
  #round(point, offset) {
    const seen = this.model.camera.project(point, this.stage.aspect);
    const pixel = seen ? seen.height / Math.max(1, this.stage.surface.clientHeight) : 0;
    const digits = pixel > 0 ? Math.min(15, Math.max(0, -Math.floor(Math.log10(pixel)))) : 15;
    return offset.map((value) => Number(value.toFixed(digits)));
  }

  #moveBy(start, offset) {
    this.target()?.move?.(add(start, this.#round(start, offset)));
  }

  #dragAxis(axis, ray) {
    const start = this.target()?.position;
    const from = start && nearestOnAxis(start, axis, ray);
    if (from === null || from === undefined) return null;
    return (now) => {
      const to = nearestOnAxis(start, axis, now);
      if (to !== null) this.#moveBy(start, axis.map((value) => value * (to - from)));
    };
  }

  #dragPlane(ray) {
    const target = this.target();
    const normal = this.model.camera.backward;
    const from = target?.move && onPlane(target.position, normal, ray);
    if (!from) return null;
    return (now) => {
      const to = onPlane(target.position, normal, now);
      if (to) this.#moveBy(target.position, add(to, from, -1));
    };
  }

  #dragBall() {
    return (now) => {
      const target = this.target();
      const seen = target && this.model.camera.project(target.position, this.stage.aspect);
      if (!seen || !target.aim) return;
      const radius = (AIM_PX * seen.height) / Math.max(1, this.stage.surface.clientHeight);
      const found = onSphere(target.position, radius, unit(target.direction), now);
      if (found) target.aim(found.map((value) => Number(value.toFixed(4)) || 0));
    };
  }

  // ---- drawing ----

  /** Pixels of a point of the world on the surface; null behind the eye. */
  #pixels(point) {
    const seen = this.model.camera.project(point, this.stage.aspect);
    const { clientWidth, clientHeight } = this.stage.surface;
    return seen && [seen.x * clientWidth, seen.y * clientHeight, seen.height / clientHeight];
  }

  update() {
    const target = this.model.scene ? this.target() : null;
    const dots = this.model.scene ? this.dots() : [];
    const at = target && this.#pixels(target.position);
    this.root.toggleAttribute("data-shown", Boolean(at) || dots.length > 0);
    this.#drawDots(dots);
    const isAimed = Boolean(at && target.direction);
    for (const part of [this.stem, this.ball.group]) part.toggleAttribute("hidden", !isAimed);
    const canMove = Boolean(at && target.move);
    const isFree = canMove && !target.along;
    this.center.group.toggleAttribute("hidden", !isFree);
    for (const { arm } of this.axes) arm.toggleAttribute("hidden", !isFree);
    this.along.arm.toggleAttribute("hidden", !canMove || isFree);
    this.lines.setAttribute("d", at && target.outlines
      ? target.outlines(2 * AIM_PX * at[2]).map((line) => this.#path(line)).join("") : "");
    if (canMove) this.#drawAxes(isFree ? this.axes : [this.along], target.position, at);
    if (isAimed) this.#drawBall(target, at);
  }

  #path(line) {
    const pixels = line.map((point) => this.#pixels(point));
    return pixels.includes(null) ? ""
      : `M${pixels.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}`;
  }

  #drawAxes(arms, position, [x, y, pixel]) {
    for (const { arm, axisOf, line, tip, reach } of arms) {
      const end = this.#pixels(add(position, axisOf(), ARM_PX * pixel));
      const isShort = !end || Math.hypot(end[0] - x, end[1] - y) < SHORT_PX;
      arm.toggleAttribute("hidden", isShort);
      if (isShort) continue;
      for (const one of [line, reach]) set(one, { x1: x, y1: y, x2: end[0], y2: end[1] });
      set(tip, { cx: end[0], cy: end[1] });
    }
    for (const one of this.center.circles) set(one, { cx: x, cy: y });
  }

  #drawBall({ position, direction }, [x, y, pixel]) {
    const axis = unit(direction);
    const end = axis && this.#pixels(add(position, axis, AIM_PX * pixel));
    this.ball.group.toggleAttribute("hidden", !end);
    this.stem.toggleAttribute("hidden", !end);
    if (!end) return;
    set(this.stem, { x1: x, y1: y, x2: end[0], y2: end[1] });
    for (const one of this.ball.circles) set(one, { cx: end[0], cy: end[1] });
  }

  #drawDots(dots) {
    while (this.dotLayer.childElementCount > dots.length) this.dotLayer.lastChild.remove();
    while (this.dotLayer.childElementCount < dots.length) {
      const dot = node(this.dotLayer, "circle", "gizmo-dot");
      dot.setAttribute("r", 6);
      node(dot, "title", "");
      dot.addEventListener("pointerdown", (event) => event.stopPropagation());
      dot.addEventListener("click", () => dot.choose());
    }
    dots.forEach(({ position, color, name, choose }, i) => {
      const dot = this.dotLayer.children[i];
      const at = this.#pixels(position);
      dot.toggleAttribute("hidden", !at);
      if (at) set(dot, { cx: at[0], cy: at[1] });
      dot.style.fill = color;
      dot.firstChild.textContent = name;
      dot.choose = choose;
    });
  }
}
