// SPDX-License-Identifier: MIT
// Small helpers to build elements: no markup from strings, so that no text can become code.
import { ICONS } from "./icons.js";

const SVG = "http://www.w3.org/2000/svg";

/** One element by its id; it must be there. */
export function byId(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found;
}

/**
 * An element. Properties that start with "on" are listeners, "class" and those with a dash or
 * "role" are attributes, the others are set on the object; undefined and null are passed over.
 */
export function el(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "class") element.className = value;
    else if (name.includes("-") || name === "role" || name === "for" || name === "list")
      element.setAttribute(name, value);
    else element[name] = value;
  }
  append(element, children);
  return element;
}

/** Adds children: elements, texts, lists of them; null and false are passed over. */
export function append(element, children) {
  for (const child of [children].flat(Infinity))
    if (child !== null && child !== undefined && child !== false)
      element.append(child instanceof Node ? child : String(child));
}

export function replace(element, ...children) {
  element.replaceChildren();
  append(element, children);
}

/** An SVG element of a class at the end of another one. */
export function svgNode(parent, tag, className = "") {
  const made = document.createElementNS(SVG, tag);
  if (className) made.setAttribute("class", className);
  parent.append(made);
  return made;
}

export function setAttributes(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
}

/** One of our icons as inline SVG, coloured by the text around it. */
export function icon(name, size = 16) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("width", size);
  svg.setAttribute("height", size);
  svg.setAttribute("aria-hidden", "true");
  svg.setAttribute("class", "icon");
  const path = document.createElementNS(SVG, "path");
  path.setAttribute("d", ICONS[name]);
  svg.append(path);
  return svg;
}

/** A button with an icon, and its words as text or as label. */
export function button({ label, icon: name, text, onclick, ...more }) {
  return el(
    "button",
    { type: "button", "aria-label": text ? undefined : label, title: label, onclick, ...more },
    name && icon(name),
    text && el("span", {}, text),
  );
}

/** Says something to screen readers without showing it. */
export function announce(text) {
  byId("announce").textContent = text;
}

/** Numbers for people: four digits, no exponents where they can be avoided. */
export function number(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e7 || size < 1e-4)) return value.toExponential(2);
  return String(Number(value.toPrecision(digits)));
}

/** A point for people, in metres: to a hundred-thousandth of the size of what it is part of. */
export function place(point, size) {
  const step = 10 ** (Math.floor(Math.log10(Math.max(size, 1e-9))) - 5);
  return point.map((value) => number(Math.round(value / step) * step || 0, 6)).join("  ");
}

export function bytes(count) {
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  let unit = 0;
  for (; count >= 1024 && unit < units.length - 1; unit++) count /= 1024;
  return `${unit ? count.toFixed(count < 10 ? 1 : 0) : count} ${units[unit]}`;
}

export function count(value) {
  return value.toLocaleString("en-US").replaceAll(",", "\u202f");
}
