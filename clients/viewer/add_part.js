// SPDX-License-Identifier: MIT
// The dialogue that puts another scene of the server into the one that shows.
import { button, byId, el, replace } from "./dom.js";
import { checkField, selectField } from "./fields.js";

const nameOf = ({ name, id }) => (name ?? `Scene ${id.slice(0, 8)}`).replace(/\.(glb|gltf)$/i, "");

/**
 * @param {object[]} scenes on the server
 * @param {string} below name of the node that is selected; "" for none
 * @param {(chosen: {id: string, name: string, isBelow: boolean}) => void} add
 */
export function openAddPart(scenes, below, add) {
  const dialog = byId("help");
  const chosen = { id: scenes[0]?.id ?? "", name: "", isBelow: false };
  const name = el("input", { type: "text", id: "part-name", maxLength: 60 });
  const suggest = () => {
    const scene = scenes.find(({ id }) => id === chosen.id);
    name.value = scene ? nameOf(scene) : "";
  };
  suggest();
  replace(dialog, el("h2", { id: "help-title" }, "Add a part"),
    el("p", { class: "fine" }, "Another scene of this server, in this one. It can be moved, hidden and "
      + "taken out again; nothing is uploaded anew."),
    selectField({ label: "Scene", value: chosen.id, options: scenes.map((scene) => [scene.id, nameOf(scene)]),
      onchange: (id) => {
        chosen.id = id;
        suggest();
      } }).row,
    el("div", { class: "field" }, el("label", { for: "part-name" }, "Name"), name),
    below && checkField({ label: `Moves with ${below}`, value: false,
      onchange: (isBelow) => (chosen.isBelow = isBelow) }).row,
    el("div", { class: "row row-end" },
      button({ text: "Cancel", onclick: () => dialog.close() }),
      button({ text: "Add", icon: "add", class: "primary", disabled: !scenes.length, onclick: () => {
        dialog.close();
        add({ ...chosen, name: name.value.trim() });
      } })));
  dialog.showModal();
}
