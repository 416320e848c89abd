// SPDX-License-Identifier: MIT
// Handles over the picture: what can be moved has three axes and a middle, what shines somewhere a
// ball to aim it by, what can be turned rings. They are for the pointer; the same values are fields
// in the panels. While Shift is held, what is dragged keeps to steps.
import { byId, number, setAttributes, svgNode } from "./dom.js";
import { nearestOnAxis, onPlane, onSphere } from "./gizmo_math.js";
import { TurnHandles } from "./gizmo_turn.js";
import { AXES, add, unit } from "./transforms.js";

const ARM_PX = 74; // of the axes
const AIM_PX = 118; // of the way to the ball
const SHORT_PX = 14; // an axis that is seen shorter points at us and cannot be dragged
const SNAP_PX = 10; // the least step of a move while Shift is held
const SNAP_RAD = Math.PI / 12; // and of the angles of a direction
const NAMES = ["x", "y", "z"];

/** The least of 1, 2, 5, 10, 20 ... that is no less. */
function roundStep(least) {
  const base = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * base).find((step) => step >= least * (1 - 1e-9));
}

/** A direction whose angles above the horizon and around +Y are in whole steps. */
function snappedDirection([x, y, z]) {
  const [yaw, pitch] = [Math.atan2(x, z), Math.asin(Math.min(1, Math.max(-1, y)))]
    .map((angle) => Math.round(angle / SNAP_RAD) * SNAP_RAD);
  return [Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)];
}

/**
 * @typedef {object} Target what the handles hold
 * @property {number[]} position in the world
 * @property {number[]} [along] unit: moved along it alone, instead of along the axes of the world
 * @property {number[]} [direction] with a ball to aim it by
 * @property {(distance: number) => number[][][]} [outlines] lines to show with it
 * @property {(position: number[]) => void} [move] absent: it cannot be moved
 * @property {(direction: number[]) => void} [aim]
 * @property {(axis: number[], degrees: number) => void} [turn] about an axis through the position,
 * from how it was when this target was asked for
 * @property {boolean} [canRoll] a turn about its own direction changes something
 * @property {(factor: number) => void} [scale] likewise
 */
export class Gizmo {
  #held = null; // what is being dragged: {pointer, drag}
  pivot = null; // where the handles stay while what they hold is turned
  said = ""; // how far it has been dragged

  /**
   * @param {() => Target|null} target
   * @param {() => {position: number[], color: string, name: string, choose: () => void}[]} dots
   */
  constructor(stage, model, { target, dots }) {
    Object.assign(this, { stage, model, target, dots });
    this.root = byId("gizmo");
    this.lines = svgNode(this.root, "path", "gizmo-outline");
    this.dotLayer = svgNode(this.root, "g", "gizmo-dots");
    this.stem = svgNode(this.root, "line", "gizmo-stem");
    this.turns = new TurnHandles(this);
    this.axes = NAMES.map((name, i) => this.#axis(name, () => AXES[i]));
    this.along = this.#axis("n", () => this.target()?.along);
    this.center = this.#handle("circle", "gizmo-center", 8, ({ ray }) => this.#dragPlane(ray));
    this.ball = this.#handle("circle", "gizmo-ball", 8, () => this.#dragBall());
    this.text = svgNode(this.root, "text", "gizmo-said");
    model.addEventListener("scene", () => this.#release());
  }

  /** An arm to drag along an axis, which is asked for when it is grabbed. */
  #axis(name, axisOf) {
    const arm = svgNode(this.root, "g", `gizmo-axis gizmo-${name}`);
    const parts = { arm, line: svgNode(arm, "line", "gizmo-line"), tip: svgNode(arm, "circle", "gizmo-tip"),
      reach: svgNode(arm, "line", "gizmo-reach") };
    parts.tip.setAttribute("r", 5);
    arm.dataset.handle = name;
    this.listen(arm, ({ ray }) => this.#dragAxis(axisOf(), ray));
    return { ...parts, axisOf };
  }

  #handle(tag, className, radius, grab) {
    const group = svgNode(this.root, "g", className);
    group.dataset.handle = className.split("-")[1];
    const [seen, reach] = [svgNode(group, tag, "gizmo-tip"), svgNode(group, tag, "gizmo-reach")];
    seen.setAttribute("r", radius);
    reach.setAttribute("r", 4);
    this.listen(group, grab);
    return { group, circles: [seen, reach] };
  }

  // ---- dragging ----

  #pointer(event) {
    const { x, y } = this.stage.shareOf(event);
    const { clientWidth, clientHeight } = this.stage.surface;
    return { ray: this.model.camera.rayAt({ x, y }, this.stage.aspect),
      pixel: [x * clientWidth, y * clientHeight], isSnapping: event.shiftKey };
  }

  /** grab answers what to do with the moves that follow, or null. */
  listen(element, grab) {
    element.addEventListener("pointerdown", (event) => {
      event.stopPropagation(); // the picture stays where it is
      if (event.button !== 0 || this.#held) return;
      const drag = grab(this.#pointer(event));
      if (!drag) return;
      element.setPointerCapture(event.pointerId);
      this.#held = { pointer: event.pointerId, drag };
      this.model.hold(true);
      this.root.dataset.held = element.dataset.handle;
    });
    element.addEventListener("pointermove", (event) => {
      if (this.#held?.pointer !== event.pointerId) return;
      event.stopPropagation();
      this.#held.drag(this.#pointer(event));
    });
    for (const type of ["pointerup", "pointercancel"])
      element.addEventListener(type, (event) => {
        event.stopPropagation();
        if (this.#held?.pointer === event.pointerId) this.#release();
      });
    element.addEventListener("dblclick", (event) => event.stopPropagation());
  }

  #release() {
    this.#held = this.pivot = null;
    this.model.hold(false);
    this.said = "";
    delete this.root.dataset.held;
    this.turns.release();
    this.update();
  }

  /** Metres in steps that a pixel can tell apart at a point, or in larger ones. */
  #rounded(point, metres, isSnapping) {
    const pixel = this.pixels(point)?.[2] ?? 0;
    if (!(pixel > 0)) return metres;
    const step = isSnapping ? roundStep(SNAP_PX * pixel) : 10 ** Math.floor(Math.log10(pixel));
    return Number((Math.round(metres / step) * step).toPrecision(12)) || 0;
  }

  #dragAxis(axis, ray) {
    const target = this.target();
    const start = target?.position;
    const from = start && nearestOnAxis(start, axis, ray);
    if (from === null || from === undefined) return null;
    return (now) => {
      const to = nearestOnAxis(start, axis, now.ray);
      if (to === null) return;
      const way = this.#rounded(start, to - from, now.isSnapping);
      this.said = `${number(way)} m`;
      target.move(add(start, axis, way));
    };
  }

  #dragPlane(ray) {
    const target = this.target();
    const normal = this.model.camera.backward;
    const from = target?.move && onPlane(target.position, normal, ray);
    if (!from) return null;
    return (now) => {
      const to = onPlane(target.position, normal, now.ray);
      if (!to) return;
      const way = add(to, from, -1).map((metres) =>
        this.#rounded(target.position, metres, now.isSnapping));
      this.said = `${number(Math.hypot(...way))} m`;
      target.move(add(target.position, way));
    };
  }

  #dragBall() {
    return (now) => {
      const target = this.target();
      const seen = target && this.pixels(target.position);
      if (!seen || !target.aim) return;
      const found = onSphere(target.position, AIM_PX * seen[2], unit(target.direction), now.ray);
      if (!found) return;
      const way = now.isSnapping ? snappedDirection(found) : found;
      target.aim(way.map((value) => Number(value.toFixed(now.isSnapping ? 12 : 4)) || 0));
    };
  }

  // ---- drawing ----

  /** Pixels of a point of the world on the surface; null behind the eye. */
  pixels(point) {
    const seen = this.model.camera.project(point, this.stage.aspect);
    const { clientWidth, clientHeight } = this.stage.surface;
    return seen && [seen.x * clientWidth, seen.y * clientHeight, seen.height / clientHeight];
  }

  /** The unit direction from a point of the world to the eye. */
  toEye(point) {
    const { camera } = this.model;
    return camera.isOrthographic ? camera.backward
      : unit(add(camera.eye, point, -1)) ?? camera.backward;
  }

  /** The unit direction in pixels of a direction of the world at a point; null when it points at us. */
  wayOnScreen(point, direction) {
    const from = this.pixels(point);
    const to = from && this.pixels(add(point, direction, ARM_PX * from[2]));
    return to && unit([to[0] - from[0], to[1] - from[1]]);
  }

  update() {
    const asked = this.model.scene ? this.target() : null;
    const target = asked && { ...asked, position: this.pivot ?? asked.position };
    const dots = this.model.scene ? this.dots() : [];
    const at = target && this.pixels(target.position);
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
    this.turns.draw(target, at);
    this.text.textContent = at ? this.said : "";
    if (at && this.said) setAttributes(this.text, { x: at[0], y: at[1] + AIM_PX + 14 });
  }

  #path(line) {
    const pixels = line.map((point) => this.pixels(point));
    return pixels.includes(null) ? ""
      : `M${pixels.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}`;
  }

  #drawAxes(arms, position, [x, y, pixel]) {
    for (const { arm, axisOf, line, tip, reach } of arms) {
      const end = this.pixels(add(position, axisOf(), ARM_PX * pixel));
      const isShort = !end || Math.hypot(end[0] - x, end[1] - y) < SHORT_PX;
      arm.toggleAttribute("hidden", isShort);
      if (isShort) continue;
      for (const one of [line, reach]) setAttributes(one, { x1: x, y1: y, x2: end[0], y2: end[1] });
      setAttributes(tip, { cx: end[0], cy: end[1] });
    }
    for (const one of this.center.circles) setAttributes(one, { cx: x, cy: y });
  }

  #drawBall({ position, direction }, [x, y, pixel]) {
    const axis = unit(direction);
    const end = axis && this.pixels(add(position, axis, AIM_PX * pixel));
    this.ball.group.toggleAttribute("hidden", !end);
    this.stem.toggleAttribute("hidden", !end);
    if (!end) return;
    setAttributes(this.stem, { x1: x, y1: y, x2: end[0], y2: end[1] });
    for (const one of this.ball.circles) setAttributes(one, { cx: end[0], cy: end[1] });
  }

  #drawDots(dots) {
    while (this.dotLayer.childElementCount > dots.length) this.dotLayer.lastChild.remove();
    while (this.dotLayer.childElementCount < dots.length) {
      const dot = svgNode(this.dotLayer, "circle", "gizmo-dot");
      dot.setAttribute("r", 6);
      svgNode(dot, "title", "");
      dot.addEventListener("pointerdown", (event) => event.stopPropagation());
      dot.addEventListener("click", () => dot.choose());
    }
    dots.forEach(({ position, color, name, choose }, i) => {
      const dot = this.dotLayer.children[i];
      const at = this.pixels(position);
      dot.toggleAttribute("hidden", !at);
      if (at) setAttributes(dot, { cx: at[0], cy: at[1] });
      dot.style.fill = color;
      dot.firstChild.textContent = name;
      dot.choose = choose;
    });
  }
}
