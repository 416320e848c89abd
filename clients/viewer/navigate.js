// SPDX-License-Identifier: MIT
// Mouse, touch, pen and keyboard on the picture: orbit, pan, zoom, fly, pick.

const CLICK_PX = 5; // a press that moves less is a click
const TURN_DEG = 220; // a drag over the whole height turns so far
const KEY_TURN_DEG = 5;
const FLY_KEYS = {
  KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0],
  KeyE: [0, 1, 0], KeyQ: [0, -1, 0],
};
const FLY_SHARE = 0.35; // of the distance to the target, each second

const middle = (points) => ({
  x: points.reduce((sum, point) => sum + point.x, 0) / points.length,
  y: points.reduce((sum, point) => sum + point.y, 0) / points.length,
});
const spread = ([a, b]) => Math.hypot(a.x - b.x, a.y - b.y);

/** Moves the camera of a model by what happens on the surface of a stage. */
export class Navigator {
  #pointers = new Map();
  #moved = 0;
  #held = new Set();
  #lastTime = 0;

  /** @param {{pick: (share: {x, y}) => void, aim: (share: {x, y}) => void}} actions */
  constructor(model, stage, actions) {
    this.model = model;
    this.stage = stage;
    this.actions = actions;
    const { surface } = stage;
    surface.addEventListener("pointerdown", (event) => this.#press(event));
    surface.addEventListener("pointermove", (event) => this.#drag(event));
    surface.addEventListener("pointerup", (event) => this.#release(event, true));
    surface.addEventListener("pointercancel", (event) => this.#release(event, false));
    surface.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    surface.addEventListener("dblclick", (event) => actions.aim(stage.shareOf(event)));
    surface.addEventListener("contextmenu", (event) => event.preventDefault());
    surface.addEventListener("keydown", (event) => this.#key(event));
    surface.addEventListener("keyup", (event) => this.#held.delete(event.code));
    surface.addEventListener("blur", () => this.#held.clear());
  }

  get camera() {
    return this.model.camera;
  }

  // ---- pointers ----

  #press(event) {
    if (!this.model.scene) return;
    this.stage.surface.setPointerCapture(event.pointerId);
    this.stage.surface.focus({ preventScroll: true });
    if (event.button === 1) event.preventDefault(); // no scrolling by the middle button
    if (this.#pointers.size === 0) this.#moved = 0;
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  #drag(event) {
    const before = [...this.#pointers.values()];
    const pointer = this.#pointers.get(event.pointerId);
    if (!pointer) return;
    this.#moved += Math.hypot(event.clientX - pointer.x, event.clientY - pointer.y);
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.#moved < CLICK_PX) return;
    const after = [...this.#pointers.values()];
    const [from, to] = [middle(before), middle(after)];
    const height = Math.max(1, this.stage.surface.clientHeight);
    const [right, down] = [(to.x - from.x) / height, (to.y - from.y) / height];
    if (after.length === 2) this.camera.zoom(spread(before) / Math.max(1, spread(after)));
    if (after.length === 2 || event.buttons & 6 || event.shiftKey) this.camera.pan(-right, down);
    else if (event.ctrlKey || event.metaKey) this.camera.zoom(1 + 2 * down);
    else this.camera.orbit(-right * TURN_DEG, down * TURN_DEG);
    this.model.cameraMoved();
  }

  #release(event, isWanted) {
    const isLast = this.#pointers.delete(event.pointerId) && this.#pointers.size === 0;
    if (isWanted && isLast && event.button === 0 && this.#moved < CLICK_PX)
      this.actions.pick(this.stage.shareOf(event));
  }

  /** The point under the pointer stays under it. */
  #wheel(event) {
    if (!this.model.scene) return;
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1; // lines or pixels
    const factor = Math.exp(Math.max(-1, Math.min(1, 0.0016 * lines * event.deltaY)));
    const { x, y } = this.stage.shareOf(event);
    const place = [(x - 0.5) * this.stage.aspect, 0.5 - y];
    const before = this.camera.pointAt(...place);
    this.camera.zoom(factor);
    const after = this.camera.pointAt(...place);
    this.camera.target = this.camera.target.map((value, i) => value + before[i] - after[i]);
    this.model.cameraMoved();
  }

  // ---- keyboard ----

  #key(event) {
    if (!this.model.scene || event.ctrlKey || event.metaKey || event.altKey) return;
    const turn = event.shiftKey ? null : KEY_TURN_DEG;
    const moves = {
      ArrowLeft: () => (turn ? this.camera.orbit(-turn, 0) : this.camera.pan(-0.05, 0)),
      ArrowRight: () => (turn ? this.camera.orbit(turn, 0) : this.camera.pan(0.05, 0)),
      ArrowUp: () => (turn ? this.camera.orbit(0, turn) : this.camera.pan(0, 0.05)),
      ArrowDown: () => (turn ? this.camera.orbit(0, -turn) : this.camera.pan(0, -0.05)),
      "+": () => this.camera.zoom(0.9),
      "=": () => this.camera.zoom(0.9),
      "-": () => this.camera.zoom(1 / 0.9),
      Enter: () => this.actions.pick({ x: 0.5, y: 0.5 }),
    };
    if (event.key in moves) {
      moves[event.key]();
      this.model.cameraMoved();
    } else if (event.code in FLY_KEYS && !event.shiftKey) {
      const wasIdle = this.#held.size === 0;
      this.#held.add(event.code);
      if (wasIdle) this.#fly();
    } else return;
    event.preventDefault();
  }

  #fly() {
    this.#lastTime = performance.now();
    const step = (now) => {
      if (this.#held.size === 0) return;
      const seconds = Math.min(0.1, Math.max(0.001, (now - this.#lastTime) / 1000));
      this.#lastTime = now;
      const share = FLY_SHARE * seconds * this.camera.distance;
      const sum = [0, 0, 0];
      for (const code of this.#held) FLY_KEYS[code].forEach((value, i) => (sum[i] += value));
      this.camera.fly(...sum.map((value) => value * share));
      this.model.cameraMoved();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
