// SPDX-License-Identifier: MIT
// How far a picture is that takes long, by what the server has finished of it.
import { byId, el, replace } from "./dom.js";

const STAGES = { shadows: "Shadows", rays: "Tracing rays", shading: "Shading" };

/** "Shadows, 34 %, about 12 s" */
export function wordsOf({ stage, share, left_s: left }) {
  const rest = left === null ? "" : left >= 1 ? `, about ${Math.ceil(left)} s` : ", nearly done";
  return `${STAGES[stage] ?? stage}, ${Math.floor(100 * share)} %${rest}`;
}

/** A bar and its words over the picture, while one is made and the server tells of it. */
export class FrameProgress {
  constructor() {
    this.root = byId("frame-progress");
    this.bar = el("progress", { max: 1, "aria-label": "Picture in the making" });
    this.said = el("span");
    replace(this.root, this.bar, this.said);
  }

  show(progress) {
    this.bar.value = progress.share;
    this.said.textContent = wordsOf(progress);
    this.root.hidden = false;
  }

  hide() {
    this.root.hidden = true;
  }
}
