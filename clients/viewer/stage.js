// SPDX-License-Identifier: MIT
// The picture on the page: its size in pixels, its drawing, the mark of what was picked, and the
// second picture of a comparison with its divider.
import { byId } from "./dom.js";

const SIDE_MAX = 4096; // pixels; more is for a saved image
const SETTLE_MS = 120; // a window being dragged asks for no pictures

/** Events: "resize" when the picture should have another size, "divide" when the divider moved. */
export class Stage extends EventTarget {
  surface = byId("surface");
  canvas = byId("picture");
  second = byId("picture-b");
  divider = byId("divider");
  mark = byId("selection");
  scale = 1; // pixels of the picture per pixel of the screen
  share = 0.5; // of the width, left of the divider

  constructor() {
    super();
    new ResizeObserver(() => {
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.dispatchEvent(new Event("resize")), SETTLE_MS);
    }).observe(this.surface);
    this.#moveDivider();
  }

  /** Pixels of the picture that fits the surface. */
  get size() {
    const { clientWidth, clientHeight } = this.surface;
    const scale = this.scale * Math.min(globalThis.devicePixelRatio || 1, 2);
    const most = Math.max(clientWidth, clientHeight) * scale;
    const kept = scale * Math.min(1, SIDE_MAX / Math.max(1, most));
    return {
      width: Math.max(16, Math.round(clientWidth * kept)),
      height: Math.max(16, Math.round(clientHeight * kept)),
    };
  }

  get aspect() {
    return this.surface.clientWidth / Math.max(1, this.surface.clientHeight);
  }

  /** Shows a picture and lets go of it. */
  draw(bitmap, canvas = this.canvas) {
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
    }
    const context = canvas.getContext("2d", { willReadFrequently: canvas.dataset.isRead === "true" });
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(bitmap, 0, 0);
    bitmap.close();
    canvas.dataset.frames = Number(canvas.dataset.frames ?? 0) + 1;
  }

  clear() {
    for (const canvas of [this.canvas, this.second])
      canvas.getContext("2d").clearRect(0, 0, canvas.width, canvas.height);
    this.canvas.setAttribute("aria-label", "No picture yet");
  }

  /** A point of the screen as shares of the surface, from its upper left corner. */
  shareOf(event) {
    const box = this.surface.getBoundingClientRect();
    return {
      x: (event.clientX - box.left) / box.width,
      y: (event.clientY - box.top) / box.height,
    };
  }

  /** Puts the mark at a point of the world, or takes it away. */
  markAt(point, camera) {
    const position = point && camera.project(point, this.aspect);
    const isShown = position && Math.max(position.x, position.y) <= 1 && Math.min(position.x, position.y) >= 0;
    this.mark.hidden = !isShown;
    if (!isShown) return;
    this.mark.style.left = `${100 * position.x}%`;
    this.mark.style.top = `${100 * position.y}%`;
  }

  // ---- comparison ----

  /** Shows the second picture right of the divider, or hides it. */
  compare(labels) {
    this.divider.hidden = !labels;
    this.second.hidden = !labels;
    for (const [side, name] of [["label-a", labels?.[0]], ["label-b", labels?.[1]]]) {
      byId(side).hidden = !labels;
      byId(side).textContent = name ?? "";
    }
    this.setShare(this.share);
  }

  setShare(share) {
    this.share = Math.min(1, Math.max(0, share));
    const percent = Math.round(100 * this.share);
    this.second.style.clipPath = `inset(0 0 0 ${100 * this.share}%)`;
    this.divider.style.left = `${100 * this.share}%`;
    this.divider.setAttribute("aria-valuenow", percent);
    this.divider.setAttribute("aria-valuetext", `${percent} percent`);
  }

  #moveDivider() {
    this.divider.addEventListener("pointerdown", (event) => {
      this.divider.setPointerCapture(event.pointerId);
      event.preventDefault();
      this.divider.focus();
    });
    this.divider.addEventListener("pointermove", (event) => {
      if (this.divider.hasPointerCapture(event.pointerId)) this.setShare(this.shareOf(event).x);
    });
    this.divider.addEventListener("keydown", (event) => {
      const steps = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 };
      if (!(event.key in steps)) return;
      event.preventDefault();
      event.stopPropagation();
      this.setShare(this.share + steps[event.key] * (event.shiftKey ? 5 : 1));
    });
  }
}
