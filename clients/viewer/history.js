// SPDX-License-Identifier: MIT
// Steps of undo and redo. Edits under one label in quick succession, or of one drag, are one step.
const STEPS_MAX = 100;
const TOGETHER_MS = 1000;

export class History {
  #undo = []; // {label, view}: what it was before
  #redo = [];
  #last = { label: "", time: 0 };
  #isHeld = false; // something is being dragged

  clear() {
    this.#undo = [];
    this.#redo = [];
    this.hold(false);
  }

  /** While something is dragged, all edits under one label are one step; before and after, others
   * begin. */
  hold(isHeld) {
    this.#isHeld = isHeld;
    this.#last = { label: "", time: 0 };
  }

  /** An edit is being made of this view. */
  record(label, view) {
    const now = Date.now();
    const isNext = label === this.#last.label && (this.#isHeld || now - this.#last.time <= TOGETHER_MS);
    if (!isNext) {
      this.#undo.push({ label, view });
      if (this.#undo.length > STEPS_MAX) this.#undo.shift();
    }
    this.#last = { label, time: now };
    this.#redo = [];
  }

  get canUndo() {
    return this.#undo.length > 0;
  }

  get canRedo() {
    return this.#redo.length > 0;
  }

  #step(from, to, view) {
    const step = from.pop();
    if (!step) return null;
    to.push({ label: step.label, view });
    this.#last = { label: "", time: 0 };
    return step;
  }

  /** {label, view} of the step before the present view, or null. */
  undo(view) {
    return this.#step(this.#undo, this.#redo, view);
  }

  redo(view) {
    return this.#step(this.#redo, this.#undo, view);
  }

  /** What was undone never comes back. */
  forgetRedo() {
    this.#redo = [];
  }
}
