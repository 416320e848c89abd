// SPDX-License-Identifier: MIT
// Rings around what the handles hold, to turn it about an axis of the world, and a square that
// makes it larger or smaller.
import { setAttributes, svgNode } from "./dom.js";
import { angleAbout, arc, onPlane } from "./gizmo_math.js";
import { AXES, add, cross, dot, frameOf, unit } from "./transforms.js";

const RING_PX = 94; // around the arms of the axes, within the way to the ball
const SQUARE_PX = 106; // from the middle to the upper right
const RING_STEPS = 96;
const EDGE_ON = 0.2; // cosine: a ring that is seen flatter is dragged along, as a roll is
const BEHIND = -0.08; // of the radius: what lies farther behind the middle is not drawn
const ALONG = 0.9998; // cosine: a turn about its own direction changes nothing
const SNAP_DEG = 15;
const SNAP_FACTOR = 0.1;
const NAMES = ["x", "y", "z"];

export class TurnHandles {
  #turned = null; // what has been turned so far: {axis, from, degrees}

  /** @param {Gizmo} gizmo whose handles these are */
  constructor(gizmo) {
    this.gizmo = gizmo;
    this.sweep = svgNode(gizmo.root, "path", "gizmo-sweep");
    this.rings = AXES.map((axis, i) => this.#ring(`r${NAMES[i]}`, NAMES[i], axis));
    this.square = svgNode(gizmo.root, "g", "gizmo-scale");
    this.square.dataset.handle = "scale";
    this.squares = ["gizmo-tip", "gizmo-reach"].map((name) => svgNode(this.square, "rect", name));
    for (const one of this.squares) setAttributes(one, { width: 12, height: 12, rx: 2 });
    gizmo.listen(this.square, (pointer) => this.#scale(pointer));
  }

  #ring(handle, name, axis) {
    const group = svgNode(this.gizmo.root, "g", `gizmo-ring gizmo-${name}`);
    const paths = ["gizmo-line", "gizmo-reach gizmo-reach-line"].map((one) =>
      svgNode(group, "path", one));
    group.dataset.handle = handle;
    this.gizmo.listen(group, (pointer) => this.#turn(axis, pointer));
    return { group, paths, axis };
  }

  /** Points of a ring, in order, as far as they are on our side of the middle. */
  #points(axis, position, radius) {
    const toEye = this.gizmo.toEye(position);
    const [u, v] = frameOf(axis);
    return Array.from({ length: RING_STEPS }, (_, i) => {
      const angle = (2 * Math.PI * i) / RING_STEPS;
      const way = add(u.map((value) => value * Math.cos(angle)), v, Math.sin(angle));
      return dot(way, toEye) < BEHIND ? null : add(position, way, radius);
    });
  }

  // ---- dragging ----

  /** How many degrees a ring has turned since it was grabbed, for each place of the pointer. */
  #angleOf(axis, position, pointer) {
    const { gizmo } = this;
    const start = onPlane(position, axis, pointer.ray);
    const isFlat = Math.abs(dot(axis, gizmo.toEye(position))) < EDGE_ON;
    if (start && !isFlat) {
      let last = unit(add(start, position, -1));
      if (!last) return null;
      let degrees = 0;
      return { from: last, at: ({ ray }) => {
        const hit = onPlane(position, axis, ray);
        const way = hit && unit(add(hit, position, -1));
        if (way) degrees += angleAbout(axis, last, way);
        last = way ?? last;
        return degrees;
      } };
    }
    const toEye = gizmo.toEye(position);
    const from = unit(add(toEye, axis, -dot(axis, toEye))); // the point of the ring that is nearest to us
    const way = from && gizmo.wayOnScreen(position, cross(axis, from));
    if (!way) return null;
    return { from, at: ({ pixel }) =>
      ((pixel[0] - pointer.pixel[0]) * way[0] + (pixel[1] - pointer.pixel[1]) * way[1])
        / RING_PX * (180 / Math.PI) };
  }

  #turn(axis, grabbed) {
    const target = this.gizmo.target();
    const angle = target?.turn && this.#angleOf(axis, target.position, grabbed);
    if (!angle) return null;
    this.gizmo.pivot = target.position;
    return (pointer) => {
      const step = pointer.isSnapping ? SNAP_DEG : 0.1;
      const degrees = Number((Math.round(angle.at(pointer) / step) * step).toFixed(1)) || 0;
      this.#turned = { axis, from: angle.from, degrees };
      this.gizmo.said = `${degrees > 0 ? "+" : ""}${degrees}°`;
      target.turn(axis, degrees);
      this.gizmo.update();
    };
  }

  #scale(grabbed) {
    const target = this.gizmo.target();
    const middle = target?.scale && this.gizmo.pixels(target.position);
    if (!middle) return null;
    this.gizmo.pivot = target.position;
    const out = ([x, y]) => (x - middle[0] - (y - middle[1])) / Math.SQRT2;
    const from = out(grabbed.pixel);
    if (!(from > 1)) return null;
    return (pointer) => {
      const raw = Math.max(0.01, out(pointer.pixel) / from);
      const factor = pointer.isSnapping ? Math.max(SNAP_FACTOR, Math.round(raw / SNAP_FACTOR) * SNAP_FACTOR)
        : raw;
      const kept = Number(factor.toPrecision(3));
      this.gizmo.said = `× ${kept}`;
      target.scale(kept);
      this.gizmo.update();
    };
  }

  /** Nothing is dragged any more. */
  release() {
    this.#turned = null;
  }

  // ---- drawing ----

  /** @param {Target|null} target @param {number[]} at the middle in pixels, and metres per pixel */
  draw(target, at) {
    const canTurn = Boolean(at && target.turn);
    const direction = canTurn && target.direction && !target.canRoll ? unit(target.direction) : null;
    for (const { group, paths, axis } of this.rings) {
      const isIdle = direction !== null && Math.abs(dot(axis, direction)) > ALONG;
      group.toggleAttribute("hidden", !canTurn || isIdle);
      if (!canTurn || isIdle) continue;
      const d = this.#path(this.#points(axis, target.position, RING_PX * at[2]));
      for (const path of paths) path.setAttribute("d", d);
    }
    this.square.toggleAttribute("hidden", !(at && target.scale));
    if (at && target.scale) this.#drawSquare(at);
    this.#drawSweep(canTurn ? target : null, at);
  }

  /** Runs of points that are seen; the ring is closed. */
  #path(points) {
    const gap = points.indexOf(null);
    const around = gap < 0 ? [...points, points[0]] : [...points.slice(gap), ...points.slice(0, gap)];
    let isOpen = false;
    return around.map((point) => {
      const pixel = point && this.gizmo.pixels(point);
      const step = pixel ? `${isOpen ? "L" : "M"}${pixel[0].toFixed(1)} ${pixel[1].toFixed(1)}` : "";
      isOpen = Boolean(pixel);
      return step;
    }).join("");
  }

  #drawSquare([x, y]) {
    const off = SQUARE_PX / Math.SQRT2;
    for (const one of this.squares) setAttributes(one, { x: x + off - 6, y: y - off - 6 });
  }

  /** The sector that has been turned. */
  #drawSweep(target, at) {
    this.sweep.toggleAttribute("hidden", !target || !this.#turned);
    if (!target || !this.#turned) return;
    const { axis, from, degrees } = this.#turned;
    const kept = Math.abs(degrees) > 360 ? Math.sign(degrees) * 360 : degrees;
    const rim = arc(target.position, axis, from, kept, RING_PX * at[2]);
    const pixels = [target.position, ...rim].map((point) => this.gizmo.pixels(point));
    this.sweep.setAttribute("d", pixels.includes(null) ? ""
      : `M${pixels.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}Z`);
  }
}
