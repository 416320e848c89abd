// SPDX-License-Identifier: MIT
// The address of the page names what shows, so that reloading, bookmarks and links bring it back.
import { linkFromState, stateFromLink } from "./links.js";

const LATER_MS = 400; // after the last change

export class Address {
  #timer;
  #own = ""; // what this page wrote

  constructor(model) {
    this.model = model;
  }

  /** {scene, state} that the address names, if somebody else wrote it; else null. */
  read() {
    return location.hash === this.#own ? null : stateFromLink(location.hash);
  }

  #write(hash) {
    history.replaceState(null, "", location.pathname + location.search + hash);
  }

  keep() {
    clearTimeout(this.#timer);
    if (!this.model.scene) return;
    this.#own = linkFromState(this.model.scene.id, this.model.toState());
    this.#write(this.#own);
  }

  /** Something changed, and more may. */
  keepSoon() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.keep(), LATER_MS);
  }

  clear() {
    clearTimeout(this.#timer);
    this.#own = "";
    this.#write("");
  }
}
