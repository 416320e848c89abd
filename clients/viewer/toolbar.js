// SPDX-License-Identifier: MIT
// The bar of tools above the picture, as the ARIA practices describe toolbars: Tab reaches one of
// them, arrow keys the others.
import { append, button, byId, el, icon, replace } from "./dom.js";
import { STANDARD_VIEWS } from "./camera.js";
import { SHOWN } from "./heat.js";

const NEED_A_SCENE = ["fit", "ortho", "compare", "save", "share"];

export class Toolbar {
  #tools = {};
  #active = null; // the one that Tab reaches
  #isChosen = false; // by a person; else it is the first that works

  /** @param {Viewer} viewer whose commands these are */
  constructor(viewer) {
    this.root = byId("toolbar");
    this.views = el("select", { "aria-label": "Standard views", title: "Standard views",
      onchange: () => {
        viewer.standBy(this.views.value);
        this.views.value = "";
      } });
    this.shows = el("select", { "aria-label": "What the picture shows", title: "Picture or map (M)",
      onchange: () => viewer.show(this.shows.value) }, Object.entries(SHOWN).map(([name, { text }]) =>
      el("option", { value: name }, text)));
    const tool = (name, label, iconName, onclick) => {
      this.#tools[name] = button({ label, icon: iconName, class: "tool", onclick });
      return this.#tools[name];
    };
    const group = (...children) => el("span", { class: "tool-group" }, children);
    append(this.root, [
      group(tool("undo", "Undo", "undo", () => viewer.step("undo")),
        tool("redo", "Redo", "redo", () => viewer.step("redo"))),
      group(tool("fit", "Fit (F)", "fit", () => viewer.fit()),
        el("span", { class: "tool-select" }, icon("cube"), this.views),
        tool("ortho", "Orthographic (O)", "ortho", () => viewer.toggleOrtho())),
      group(el("span", { class: "tool-select tool-shows" }, icon("map"), this.shows)),
      group(tool("compare", "Compare two techniques (C)", "compare", () => viewer.comparison.toggle()),
        tool("stats", "Statistics (I)", "stats", () => viewer.toggleStats())),
      group(tool("save", "Save the picture", "save", () => viewer.save()),
        tool("share", "Copy a link to this view", "share", () => viewer.share()),
        tool("theme", "Light, dark, or as the system", "theme", () => viewer.nextTheme()),
        tool("help", "Keys and gestures (?)", "help", () => viewer.help())),
    ]);
    this.root.addEventListener("keydown", (event) => this.#key(event));
    this.root.addEventListener("focusin", (event) => {
      this.#isChosen = true;
      this.#reach(event.target);
    });
  }

  get #controls() {
    return [...this.root.querySelectorAll("button, select")].filter(({ disabled }) => !disabled);
  }

  #reach(control) {
    this.#active = control;
    for (const one of this.root.querySelectorAll("button, select"))
      one.tabIndex = one === control ? 0 : -1;
  }

  #key(event) {
    const controls = this.#controls;
    const at = controls.indexOf(event.target);
    const last = controls.length - 1;
    const next = { ArrowRight: at === last ? 0 : at + 1, ArrowLeft: at <= 0 ? last : at - 1, Home: 0,
      End: last }[event.key];
    if (next === undefined || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    controls[next].focus();
  }

  /** The standard views, and the cameras of a scene. */
  setCameras(cameras) {
    replace(this.views, el("option", { value: "" }, "View"),
      Object.keys(STANDARD_VIEWS).map((view) =>
        el("option", { value: view }, view[0].toUpperCase() + view.slice(1))),
      cameras.map(({ name }, index) =>
        el("option", { value: `camera-${index}` }, name || `Camera ${index + 1}`)));
  }

  /** @param {{hasScene: boolean, canUndo: boolean, canRedo: boolean, pressed: object}} now */
  update({ hasScene, canUndo, canRedo, pressed }) {
    for (const name of NEED_A_SCENE) this.#tools[name].disabled = !hasScene;
    this.views.disabled = this.shows.disabled = !hasScene;
    const hadFocus = document.activeElement === this.#active; // what is disabled would lose it
    this.#tools.undo.disabled = !canUndo;
    this.#tools.redo.disabled = !canRedo;
    for (const [name, isOn] of Object.entries(pressed))
      this.#tools[name].setAttribute("aria-pressed", String(isOn));
    if (this.#isChosen && !this.#active.disabled) return;
    this.#reach(this.#controls[0]);
    if (hadFocus) this.#active.focus();
  }
}
