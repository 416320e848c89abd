// SPDX-License-Identifier: MIT
// How the page hears of the server: the state of its line below the picture, and words over the
// last picture while the server is away.
import { announce, button, byId, el, replace } from "./dom.js";
import { clearUnreached } from "./messages.js";

export class Connection {
  isLost = false;

  /** @param {{retry: () => void, back: () => void}} actions */
  constructor(actions) {
    this.actions = actions;
    this.banner = byId("lost");
  }

  /** Another state, as Live tells it. */
  show({ state, label, isLost = false }) {
    const link = byId("status-link");
    link.dataset.state = state;
    link.textContent = label;
    if (isLost && !this.isLost) {
      replace(this.banner, el("p", {}, "The server cannot be reached. This is the last picture."),
        button({ text: "Try now", onclick: () => this.actions.retry() }));
      this.#say(true);
    }
    if (state !== "wait" && !isLost && this.isLost) { // there again, if only to refuse
      this.#say(false);
      clearUnreached();
      announce("The server is back");
      this.actions.back();
    }
    if (this.isLost) byId("busy").hidden = true;
  }

  /** Nothing is asked of the server any more. */
  rest() {
    this.#say(false);
  }

  #say(isLost) {
    this.isLost = isLost;
    this.banner.hidden = !isLost;
  }
}
