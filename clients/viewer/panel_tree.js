// SPDX-License-Identifier: MIT
// The nodes of the scene as a tree: find, select, hide, show. Only what is open is in the page.
import { button, el, icon } from "./dom.js";
import { empty } from "./fields.js";
import { refill } from "./docks.js";

const OPEN_AT_FIRST_MAX = 200; // rows; larger scenes start closed
const FOUND_MAX = 300;

export class TreePanel {
  #open = new Set();
  #children = [];
  #roots = [];
  #query = "";
  #active = 0; // the row that Tab reaches

  constructor(panel, model) {
    Object.assign(this, { panel, model });
    this.search = el("input", { type: "search", placeholder: "Find a node", "aria-label": "Find a node",
      oninput: () => {
        this.#query = this.search.value.trim().toLowerCase();
        this.#fillRows();
      } });
    this.rows = el("ul", { class: "tree", role: "tree", "aria-label": "Nodes",
      onkeydown: (event) => this.#key(event) });
    this.note = el("p", { class: "fine" });
    model.addEventListener("scene", () => this.#read());
    model.addEventListener("edit", () => this.#fillRows());
    model.addEventListener("select", () => this.#reveal());
    this.#read();
  }

  get #nodes() {
    return this.model.scene?.outline.nodes ?? [];
  }

  #read() {
    const nodes = this.#nodes;
    this.#children = nodes.map(() => []);
    this.#roots = [];
    nodes.forEach(({ parent }, index) =>
      (parent === null ? this.#roots : this.#children[parent]).push(index));
    this.#open = new Set(nodes.length <= OPEN_AT_FIRST_MAX ? nodes.keys() : this.#roots);
    this.#active = this.#roots[0] ?? 0;
    if (!nodes.length) {
      refill(this.panel, empty("tree", "Open a scene to see its parts."));
      return;
    }
    const more = this.model.scene.nodes - nodes.length;
    this.note.textContent = more > 0 ? `${more} further nodes are not listed` : "";
    refill(this.panel, el("div", { class: "tree-head" }, this.search,
      button({ text: "Show all", onclick: () => this.model.showAll() })), this.rows, this.note);
    this.#fillRows();
  }

  /** Opens the way to the selected node and scrolls to it. */
  #reveal() {
    const index = this.model.selection?.node ?? null;
    if (index !== null && index < this.#nodes.length) {
      for (let at = this.#nodes[index].parent; at !== null; at = this.#nodes[at].parent)
        this.#open.add(at);
      this.#active = index;
    }
    this.#fillRows();
    this.rows.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
  }

  /** [index, level] of the rows that show. */
  #shown() {
    const found = [];
    if (this.#query) {
      this.#nodes.forEach(({ name }, index) => {
        if (name.toLowerCase().includes(this.#query) && found.length < FOUND_MAX) found.push([index, 1]);
      });
      return found;
    }
    const visit = (index, level) => {
      found.push([index, level]);
      if (this.#open.has(index)) for (const child of this.#children[index]) visit(child, level + 1);
    };
    for (const root of this.#roots) visit(root, 1);
    return found;
  }

  #iconOf(index) {
    const { lights, cameras } = this.model.scene.outline;
    if (this.#nodes[index].bounds) return "mesh";
    if (lights.some(({ node }) => node === index)) return "light";
    if (cameras.some(({ node }) => node === index)) return "camera";
    return "group";
  }

  #isHiddenAbove(index) {
    for (let at = this.#nodes[index].parent; at !== null; at = this.#nodes[at].parent)
      if (!this.model.isVisible(at)) return true;
    return false;
  }

  #row([index, level]) {
    const name = this.#nodes[index].name || `Node ${index}`;
    const isVisible = this.model.isVisible(index);
    const isSelected = this.model.selection?.node === index;
    const hasChildren = this.#children[index].length > 0 && !this.#query;
    const row = el("li", { class: "node", role: "treeitem", "aria-level": level, "aria-label": name,
      "aria-selected": String(isSelected), tabIndex: index === this.#active ? 0 : -1,
      "aria-expanded": hasChildren ? String(this.#open.has(index)) : undefined,
      "data-index": index, "data-key": `node-${index}`,
      "data-hidden": !isVisible || this.#isHiddenAbove(index) ? "" : undefined,
      onclick: () => this.model.select({ node: index, material: null, position: null }) },
    el("span", { class: "twist", "data-open": this.#open.has(index) ? "" : undefined,
      onclick: (event) => {
        if (!hasChildren) return;
        event.stopPropagation();
        this.#toggle(index);
      } }, hasChildren && icon("open", 12)),
    icon(this.#iconOf(index), 14), el("span", { class: "node-name" }, name),
    button({ label: `${isVisible ? "Hide" : "Show"} ${name}`, icon: isVisible ? "eye" : "hidden",
      class: "plain", tabIndex: -1, "aria-pressed": String(!isVisible), onclick: (event) => {
        event.stopPropagation();
        this.model.setVisible(index, !isVisible);
      } }));
    row.style.setProperty("--level", level - 1);
    return row;
  }

  #fillRows() {
    if (!this.#nodes.length) return;
    const shown = this.#shown();
    if (!shown.some(([index]) => index === this.#active)) this.#active = shown[0]?.[0] ?? 0;
    refill(this.rows, shown.map((row) => this.#row(row)));
    if (!shown.length) refill(this.rows, el("li", { class: "fine", role: "none" }, "Nothing found."));
  }

  #toggle(index) {
    if (!this.#open.delete(index)) this.#open.add(index);
    this.#fillRows();
  }

  #focus(index) {
    if (index === undefined) return;
    this.#active = index;
    for (const row of this.rows.children) row.tabIndex = Number(row.dataset.index) === index ? 0 : -1;
    this.rows.querySelector(`[data-index="${index}"]`)?.focus();
  }

  #key(event) {
    const shown = this.#shown().map(([index]) => index);
    const at = shown.indexOf(this.#active);
    const index = shown[at];
    const isOpen = this.#open.has(index) && this.#children[index].length > 0;
    const actions = {
      ArrowDown: () => this.#focus(shown[at + 1]),
      ArrowUp: () => this.#focus(shown[at - 1]),
      Home: () => this.#focus(shown[0]),
      End: () => this.#focus(shown.at(-1)),
      ArrowRight: () => (isOpen ? this.#focus(this.#children[index][0]) : this.#toggle(index)),
      ArrowLeft: () => (isOpen ? this.#toggle(index) : this.#focus(this.#nodes[index].parent ?? undefined)),
      Enter: () => this.model.select({ node: index, material: null, position: null }),
      " ": () => this.model.setVisible(index, !this.model.isVisible(index)),
    };
    if (index === undefined || !(event.key in actions)) return;
    event.preventDefault();
    actions[event.key]();
  }
}
