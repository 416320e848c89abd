// SPDX-License-Identifier: MIT
// The nodes of the scene as a tree: find, select, hide, show. Rows have one height, and only those
// in sight are in the page, so that assemblies of tens of thousands of parts stay quick.
import { button, count, el, icon } from "./dom.js";
import { empty, selectField } from "./fields.js";
import { refill } from "./docks.js";
import { Rows } from "./rows.js";

const OPEN_AT_FIRST_MAX = 200; // rows; larger scenes start closed

export class TreePanel {
  #open = new Set();
  #children = [];
  #roots = [];
  #places = []; // of each node: [which of its siblings, how many they are]
  #icons = [];
  #query = "";
  #active = 0; // the row that Tab reaches
  #shown = []; // [index, level] of the rows, in sight or not
  #rowOf = new Map(); // of each index that is in #shown

  /** @param {() => void} addPart asks for another scene to put in */
  constructor(panel, model, addPart) {
    Object.assign(this, { panel, model, addPart });
    this.search = el("input", { type: "search", placeholder: "Find a part", "aria-label": "Find a part",
      oninput: () => {
        this.#query = this.search.value.trim().toLowerCase();
        this.panel.scrollTop = 0;
        this.#list();
      },
      onkeydown: (event) => this.#searchKey(event) });
    this.rows = el("ul", { class: "tree", role: "tree", "aria-label": "Nodes",
      onkeydown: (event) => this.#key(event) });
    this.note = el("p", { class: "fine", role: "status" });
    this.list = new Rows(panel, this.rows, { count: () => this.#shown.length,
      row: (at) => this.#row(this.#shown[at], at),
      kept: () => [this.#rowOf.get(this.#active) ?? -1], // has to be there for Tab and the focus
      headPx: () => this.rows.offsetTop });
    model.addEventListener("scene", () => this.#read());
    model.addEventListener("parts", () => this.#read(true));
    model.addEventListener("edit", () => {
      this.variant?.set(this.model.view.variant ?? "");
      this.#draw();
    });
    model.addEventListener("select", () => this.#reveal());
    this.#read();
  }

  get #nodes() {
    return this.model.scene?.outline.nodes ?? [];
  }

  /** @param {boolean} [isSame] the scene has other parts: what was open stays so */
  #read(isSame = false) {
    const nodes = this.#nodes;
    this.#children = nodes.map(() => []);
    this.#roots = [];
    nodes.forEach(({ parent }, index) =>
      (parent === null ? this.#roots : this.#children[parent]).push(index));
    this.#places = [];
    for (const siblings of [this.#roots, ...this.#children])
      siblings.forEach((index, at) => (this.#places[index] = [at + 1, siblings.length]));
    this.#icons = nodes.map(({ bounds }) => (bounds ? "mesh" : "group"));
    for (const kind of ["camera", "light"])
      for (const { node } of this.model.scene?.outline[`${kind}s`] ?? [])
        if (this.#icons[node] === "group") this.#icons[node] = kind;
    this.#icons = this.#icons.map((name, index) => (nodes[index].isPart ? "cube" : name));
    if (!isSame) this.#open = new Set(nodes.length <= OPEN_AT_FIRST_MAX ? nodes.keys() : this.#roots);
    this.#active = this.#roots[0] ?? 0;
    this.#query = this.search.value = "";
    if (!nodes.length) {
      refill(this.panel, empty("tree", "Open a scene to see its parts."));
      return;
    }
    refill(this.panel, el("div", { class: "tree-head" }, this.search,
      button({ text: "Show all", onclick: () => this.model.showAll() }),
      button({ label: "Add a part from another scene", icon: "add", onclick: () => this.addPart() }),
      this.note), this.#variants(), this.rows);
    this.#list();
  }

  /** Which of the file's variants of materials shows; nothing where it has none. */
  #variants() {
    const names = this.model.scene?.variants ?? [];
    this.variant = null;
    if (!names.length) return null;
    this.variant = selectField({ label: "Materials", value: this.model.view.variant ?? "",
      options: [["", "As in the file"], ...names.map((name, i) =>
        (name && names.indexOf(name) === i ? [name, name] : [`#${i}`, name || `Variant ${i + 1}`]))],
      onchange: (value) => this.model.edit("Variant of materials", (view) => {
        view.variant = value || null;
      }) });
    return this.variant.row;
  }

  /** Opens the way to the selected node and scrolls to it. */
  #reveal() {
    const index = this.model.selectedNode;
    if (index === null || index >= this.#nodes.length) {
      this.#draw();
      return;
    }
    for (let at = this.#nodes[index].parent; at !== null; at = this.#nodes[at].parent) this.#open.add(at);
    this.#active = index;
    this.#list();
    this.list.scrollTo(this.#rowOf.get(index));
  }

  // ---- which rows there are ----

  #visit(index, level) {
    this.#shown.push([index, level]);
    if (this.#open.has(index)) for (const child of this.#children[index]) this.#visit(child, level + 1);
  }

  #list() {
    const nodes = this.#nodes;
    this.#shown = [];
    if (!this.#query) for (const root of this.#roots) this.#visit(root, 1);
    else nodes.forEach(({ name }, index) =>
      name.toLowerCase().includes(this.#query) && this.#shown.push([index, 1]));
    this.#rowOf = new Map(this.#shown.map(([index], row) => [index, row]));
    if (!this.#rowOf.has(this.#active)) this.#active = this.#shown[0]?.[0] ?? 0;
    const more = (this.model.scene?.nodes ?? 0) - nodes.length;
    this.note.textContent = [
      this.#query && (this.#shown.length ? `${count(this.#shown.length)} found` : "Nothing found"),
      more > 0 && `${count(more)} further nodes are not listed`].filter(Boolean).join(" · ");
    this.#draw();
  }

  // ---- the rows in sight ----

  #draw() {
    this.list.draw(true);
  }

  #isHiddenAbove(index) {
    for (let at = this.#nodes[index].parent; at !== null; at = this.#nodes[at].parent)
      if (!this.model.isVisible(at)) return true;
    return false;
  }

  #row([index, level], at) {
    const { parent } = this.#nodes[index];
    const name = this.model.nodeName(index);
    const isVisible = this.model.isVisible(index);
    const hasChildren = this.#children[index].length > 0 && !this.#query;
    const [place, siblings] = this.#query ? [at + 1, this.#shown.length] : this.#places[index];
    const row = el("li", { class: "node", role: "treeitem", "aria-level": level, "aria-label": name,
      "aria-posinset": place, "aria-setsize": siblings,
      "aria-selected": String(this.model.selectedNode === index),
      tabIndex: index === this.#active ? 0 : -1,
      "aria-expanded": hasChildren ? String(this.#open.has(index)) : undefined,
      "data-index": index, "data-key": `node-${index}`,
      "data-hidden": !isVisible || this.#isHiddenAbove(index) ? "" : undefined,
      onclick: () => this.#select(index) },
    el("span", { class: "twist", "data-open": this.#open.has(index) ? "" : undefined,
      onclick: (event) => {
        if (!hasChildren) return;
        event.stopPropagation();
        this.#toggle(index);
      } }, hasChildren && icon("open", 12)),
    icon(this.#icons[index], 14), el("span", { class: "node-name" }, name),
    this.#query && parent !== null
      && el("span", { class: "node-parent" }, this.model.nodeName(parent)),
    button({ label: `${isVisible ? "Hide" : "Show"} ${name}`, icon: isVisible ? "eye" : "hidden",
      class: "plain", tabIndex: -1, "aria-pressed": String(!isVisible), onclick: (event) => {
        event.stopPropagation();
        this.model.setVisible(index, !isVisible);
      } }));
    row.style.setProperty("--level", level - 1);
    return row;
  }

  // ---- what people do ----

  #select(index) {
    this.model.select({ node: index, material: null, position: null });
  }

  #toggle(index) {
    if (!this.#open.delete(index)) this.#open.add(index);
    this.#list();
  }

  #focus(index) {
    if (index === undefined) return;
    this.#active = index;
    this.list.draw(true); // it is the row that Tab reaches
    this.list.scrollTo(this.#rowOf.get(index));
    this.rows.querySelector(`[data-index="${index}"]`)?.focus({ preventScroll: true });
  }

  #searchKey(event) {
    const [first] = this.#shown[0] ?? [];
    if (first === undefined || !["Enter", "ArrowDown"].includes(event.key)) return;
    event.preventDefault();
    if (event.key === "Enter") this.#select(first);
    else this.#focus(first);
  }

  #key(event) {
    const at = this.#rowOf.get(this.#active);
    const index = this.#active;
    const isOpen = this.#open.has(index) && this.#children[index].length > 0;
    const actions = {
      ArrowRight: () => (isOpen ? this.#focus(this.#children[index][0]) : this.#toggle(index)),
      ArrowLeft: () => (isOpen ? this.#toggle(index) : this.#focus(this.#nodes[index].parent ?? undefined)),
      Enter: () => this.#select(index),
      " ": () => this.model.setVisible(index, !this.model.isVisible(index)),
    };
    const to = at === undefined ? null : this.list.rowOfKey(event.key, at);
    if (at === undefined || (to === null && !(event.key in actions))) return;
    event.preventDefault();
    if (to !== null) this.#focus(this.#shown[to][0]);
    else actions[event.key]();
  }
}
