// SPDX-License-Identifier: MIT
// What is drawn over the picture: the outline of the selection, and feature edges.
import { el } from "./dom.js";
import { checkField, colorField, group, slider } from "./fields.js";

const EDGES = { crease_deg: 30, width_px: 1, hidden: 0, color: [0, 0, 0], borders: true,
  silhouettes: true }; // as the service has them where nothing is said

/**
 * The group of a panel. Adds setters to `controls`, to be called after edits by other hands.
 * @param {{isOutlined: () => boolean, outline: (isOn: boolean) => void}} actions
 */
export function drawnOverGroup(model, controls, actions) {
  const outlined = checkField({ label: "Outline what is selected", value: actions.isOutlined(),
    onchange: actions.outline });
  const edges = () => model.view.edges;
  const shown = checkField({ label: "Feature edges", value: edges() !== null, onchange: (isOn) =>
    model.edit("Feature edges", (view) => (view.edges = isOn ? {} : null)) });
  const part = (make, member, more) => {
    const read = () => edges()?.[member] ?? EDGES[member];
    const made = make({ ...more, value: read(), onchange: (value) =>
      model.edit(`Edges: ${member}`, (view) => (view.edges = { ...view.edges, [member]: value })) });
    controls.push(() => made.set(read()));
    return made.row;
  };
  const details = el("div", {},
    part(slider, "crease_deg", { label: "Crease", unit: "°", least: 0, most: 180, step: 1 }),
    part(slider, "width_px", { label: "Width", unit: "px", least: 0.5, most: 8, limit: 32, step: 0.25 }),
    part(slider, "hidden", { label: "Hidden lines", least: 0, most: 1 }),
    part(colorField, "color", { label: "Line colour" }),
    part(checkField, "borders", { label: "Borders of open surfaces" }),
    part(checkField, "silhouettes", { label: "Silhouettes" }));
  const say = () => {
    outlined.set(actions.isOutlined());
    shown.set(edges() !== null);
    details.hidden = edges() === null;
  };
  say();
  controls.push(say);
  return group("Drawn over the picture", outlined.row, shown.row, details);
}
