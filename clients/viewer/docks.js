// SPDX-License-Identifier: MIT
// The panels at both sides: tabs as the ARIA practices describe them. On a phone all tabs share a
// bar at the bottom, and the open panel is a sheet above it (the style sheet does that).
import { byId, el, icon, replace } from "./dom.js";

const isPhone = () => matchMedia("(max-width: 800px)").matches;

/** Event "show": another panel shows, or none does. */
export class Dock extends EventTarget {
  #tabs = [];

  constructor(side) {
    super();
    this.side = side;
    this.root = byId(`dock-${side}`);
    this.tablist = this.root.querySelector(".tabs");
    this.panels = this.root.querySelector(".panels");
    this.tablist.addEventListener("keydown", (event) => this.#key(event));
  }

  /** Adds a tab; answers the element that its panel fills. */
  add(id, text, iconName) {
    const panel = el("div", { class: "panel", role: "tabpanel", id: `panel-${id}`, tabIndex: 0,
      hidden: true, "aria-labelledby": `tab-${id}` });
    const tab = el("button", { type: "button", class: "tab", role: "tab", id: `tab-${id}`,
      "aria-controls": panel.id, "aria-selected": "false", tabIndex: -1,
      onclick: () => this.#click(id) }, icon(iconName), el("span", {}, text));
    this.#tabs.push({ id, tab, panel });
    this.tablist.append(tab);
    this.panels.append(panel);
    return panel;
  }

  get selected() {
    return this.#tabs.find(({ panel }) => !panel.hidden)?.id ?? null;
  }

  /** Whether people see this panel now. */
  isOpen(id) {
    return this.selected === id && (!isPhone() || document.body.dataset.sheet === this.side);
  }

  show(id) {
    this.#select(id);
    this.dispatchEvent(new Event("show"));
  }

  #select(id) {
    for (const entry of this.#tabs) {
      const isShown = entry.id === id;
      entry.panel.hidden = !isShown;
      entry.tab.setAttribute("aria-selected", String(isShown));
      entry.tab.tabIndex = isShown ? 0 : -1;
    }
  }

  /** Shows a panel, on a phone as the open sheet. */
  open(id) {
    document.body.dataset.sheet = this.side;
    this.show(id);
  }

  #click(id) {
    const isOpen = document.body.dataset.sheet === this.side && this.selected === id;
    document.body.dataset.sheet = isOpen && isPhone() ? "" : this.side;
    this.show(id);
  }

  #key(event) {
    const at = this.#tabs.findIndex(({ tab }) => tab === document.activeElement);
    const last = this.#tabs.length - 1;
    const next = { ArrowRight: at === last ? 0 : at + 1, ArrowLeft: at === 0 ? last : at - 1,
      Home: 0, End: last }[event.key];
    if (at < 0 || next === undefined) return;
    event.preventDefault();
    this.show(this.#tabs[next].id);
    this.#tabs[next].tab.focus();
  }
}

/** Fills a panel anew, keeping what has the focus if it is still there. */
export function refill(panel, ...children) {
  const key = document.activeElement?.dataset?.key;
  const top = panel.scrollTop;
  replace(panel, children);
  panel.scrollTop = top;
  if (key) panel.querySelector(`[data-key="${CSS.escape(key)}"]`)?.focus();
}
