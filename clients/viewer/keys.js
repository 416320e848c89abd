// SPDX-License-Identifier: MIT
// What keys do: undo and redo everywhere, the others while the picture has the focus. Those that
// move the camera are in navigate.js.
const TYPED = "input:not([type=range], [type=checkbox], [type=color])"; // has an undo of its own

/** @param {HTMLElement} surface of the picture @param {Viewer} viewer */
export function listenToKeys(surface, viewer) {
  addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    if (event.target.matches?.(TYPED)) return;
    event.preventDefault();
    viewer.step(event.shiftKey ? "redo" : "undo");
  });
  const actions = {
    f: () => viewer.fit(), o: () => viewer.toggleOrtho(), c: () => viewer.comparison.toggle(),
    i: () => viewer.toggleStats(), g: () => viewer.toggleMoving(), m: () => viewer.nextMap(),
    " ": () => viewer.timeline.toggle(), ",": () => viewer.timeline.step(-1),
    ".": () => viewer.timeline.step(1), "?": () => viewer.help(), h: () => viewer.toggleHidden(),
    1: () => viewer.standBy("front"), 2: () => viewer.standBy("right"),
    3: () => viewer.standBy("top"), 4: () => viewer.standBy("iso"),
    Escape: () => viewer.model.select(null),
  };
  surface.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || (!viewer.model.scene && event.key !== "?")) return;
    event.preventDefault();
    action();
  });
}
