// SPDX-License-Identifier: MIT
// Where the pointer is in the world, and on what: asked of the server while pointer and picture rest.
import { byId, place } from "./dom.js";

const REST_MS = 90; // of the pointer
const SLOW_MS = 300; // an answer that takes longer has the next ones wait as long

export class Readout {
  #share = null;
  #timer;
  #isAsking = false;
  #waitMs = REST_MS;

  /**
   * @param {{pick: (share) => Promise<object|null>, isResting: () => boolean,
   * size: () => number, nameOf: (hit) => string, also: (share) => string}} asks
   */
  constructor(stage, asks) {
    this.asks = asks;
    this.place = byId("status-place");
    stage.surface.addEventListener("pointermove", (event) => {
      this.#share = event.pointerType === "touch" || event.buttons ? null : stage.shareOf(event);
      this.#later();
    });
    stage.surface.addEventListener("pointerleave", () => {
      this.#share = null;
      this.clear();
    });
  }

  clear() {
    clearTimeout(this.#timer);
    this.place.textContent = "";
  }

  /** The picture came to rest: what is under the pointer may be another thing now. */
  refresh() {
    if (this.#share) this.#later();
  }

  #later() {
    clearTimeout(this.#timer);
    if (this.#share) this.#timer = setTimeout(() => this.#ask(), this.#waitMs);
    else this.clear();
  }

  async #ask() {
    if (!this.#share || !this.asks.isResting()) return;
    if (this.#isAsking) {
      this.#later();
      return;
    }
    const share = this.#share;
    const started = performance.now();
    this.#isAsking = true;
    try {
      const hit = await this.asks.pick(share);
      if (share === this.#share && this.asks.isResting()) this.#say(hit, this.asks.also(share));
    } catch {
      this.clear(); // the picture itself tells what is wrong
    }
    this.#isAsking = false;
    const took = performance.now() - started;
    this.#waitMs = took > SLOW_MS ? took : REST_MS;
  }

  #say(hit, also) {
    this.place.textContent = [hit ? `${place(hit.position, this.asks.size())} m` : "background", hit && this.asks.nameOf(hit), also]
      .filter(Boolean).join(" · ");
  }
}
