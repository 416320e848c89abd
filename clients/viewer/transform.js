// SPDX-License-Identifier: MIT
// The fields that place a node in its parent, and those that take it back.
import { button, el } from "./dom.js";
import { group, vectorField } from "./fields.js";
import { decompose, withRotation, withScale, withTranslation } from "./transforms.js";

const isNear = (a, b) => a.every((value, i) => Math.abs(value - b[i]) <= 1e-9 * (1 + Math.abs(b[i])));
const unsigned = (values) => values.map((value) => Number(value.toPrecision(12)) || 0); // no -0
const NOTHING_DEG = 1e-9; // what rounding makes of no turn

/**
 * The group of a node. Adds setters to `controls`, to be called after edits by other hands.
 * @param {{isMoving: () => boolean, toggleMoving: () => void}} actions of the handles in the picture
 */
export function transformGroup(model, index, controls, actions) {
  const { parent, bounds } = model.scene.outline.nodes[index];
  let typed = null; // the angles that a person said: others may mean the same matrix
  const read = () => {
    const parts = decompose(model.matrixOf(index));
    if (typed && isNear(withRotation(model.matrixOf(index), typed), model.matrixOf(index)))
      parts.rotation = typed;
    const nothing = 1e-12 * model.camera.sceneSize;
    return { translation: parts.translation.map((value) => (Math.abs(value) < nothing ? 0 : value)),
      rotation: unsigned(parts.rotation.map((value) => (Math.abs(value) < NOTHING_DEG ? 0 : value))),
      scale: unsigned(parts.scale) };
  };
  const field = (label, unit, member, change) => {
    const made = vectorField({ label, unit, value: read()[member], onchange: (values) => {
      const matrix = change(model.matrixOf(index), values);
      if (matrix) model.setMatrix(index, matrix, label === "Position" ? "Move" : label.replace(/ion$/, "e"));
      made.set(read()[member]);
    } });
    controls.push(() => made.set(read()[member]));
    return made.row;
  };
  const reset = button({ text: "Reset", icon: "reset", "data-key": `place-${index}`,
    onclick: () => model.setMatrix(index, null, "Put back") });
  const handles = button({ text: "Drag in the picture", icon: "move", title: "Handles (G)",
    "data-key": `drag-${index}`, onclick: () => actions.toggleMoving() });
  const say = () => {
    reset.disabled = !model.isMoved(index);
    handles.setAttribute("aria-pressed", String(actions.isMoving()));
  };
  say();
  controls.push(say);
  return group("Place", parent !== null && el("p", { class: "fine" },
    `in ${model.nodeName(parent)}`),
  field("Position", "m", "translation", withTranslation),
  field("Rotation", "°", "rotation", (matrix, values) => {
    typed = values;
    return withRotation(matrix, values);
  }),
  field("Scale", null, "scale", withScale),
  el("div", { class: "row" }, (bounds || model.boundsOf(index)) && handles, reset));
}
