// SPDX-License-Identifier: MIT
// Labelled controls of the panels. Each answers {row, set}: the element to show, and a setter that
// leaves alone what a person is typing into.
import { el, icon, number } from "./dom.js";
import { hexFromLinear, linearFromHex } from "./color.js";

let serial = 0;
const freshId = () => `field-${++serial}`;
const isFocused = (input) => document.activeElement === input;

/** A number by slider and by keyboard. least to most is the slider's range, typing may go to limit. */
export function slider({ label, unit, least, most, limit = most, step, value, onchange, curve = 1 }) {
  const id = freshId();
  const toSlider = (v) => Math.max(0, (v - least) / (most - least)) ** (1 / curve);
  const text = el("input", { type: "number", id, min: least, max: limit, step: "any",
    value: number(value), class: "number" });
  const range = el("input", { type: "range", min: 0, max: 1, step: step ? step / (most - least) : 0.001,
    value: toSlider(value), "aria-label": `${label}, slider` });
  range.addEventListener("input", () => {
    const raw = least + (most - least) * range.valueAsNumber ** curve;
    const picked = step ? Math.round(raw / step) * step : raw;
    text.value = number(picked, 3);
    onchange(Number(text.value));
  });
  text.addEventListener("change", () => {
    if (!Number.isFinite(text.valueAsNumber)) return;
    const kept = Math.min(limit, Math.max(least, text.valueAsNumber));
    text.value = number(kept);
    range.value = toSlider(kept);
    onchange(kept);
  });
  return {
    row: el("div", { class: "field field-slider" },
      el("label", { for: id }, label, unit && el("small", {}, ` ${unit}`)), range, text),
    set(v) {
      if (!isFocused(text)) text.value = number(v);
      if (!isFocused(range)) range.value = toSlider(v);
    },
  };
}

/** One number by keyboard alone. */
export function numberField(options) {
  const { label, unit, least, most, value, placeholder, onchange, isOptional, hint } = options;
  const id = freshId();
  const show = (v) => (v === null || v === undefined ? "" : number(v, 6));
  const input = el("input", { type: "number", id, min: least, max: most, step: "any", placeholder,
    title: hint, value: show(value), class: "number" });
  input.addEventListener("change", () => {
    if (input.value === "" && isOptional) onchange(null);
    else if (Number.isFinite(input.valueAsNumber)) {
      const kept = Math.min(most ?? Infinity, Math.max(least ?? -Infinity, input.valueAsNumber));
      input.value = show(kept);
      onchange(kept);
    } else input.value = show(value);
  });
  return {
    row: el("div", { class: "field" },
      el("label", { for: id }, label, unit && el("small", {}, ` ${unit}`)), input),
    set(v) {
      if (!isFocused(input)) input.value = show(v);
    },
  };
}

/** Three numbers in a row; those that are not typed into keep all their digits. */
export function vectorField({ label, unit, value, onchange }) {
  let current = [...value];
  const inputs = ["X", "Y", "Z"].map((axis, i) =>
    el("input", { type: "number", step: "any", value: number(value[i]), class: "number",
      "aria-label": `${label} ${axis}`, onchange: (event) => {
        if (!Number.isFinite(event.target.valueAsNumber)) return;
        current = current.map((own, at) => (at === i ? event.target.valueAsNumber : own));
        onchange(current);
      } }));
  return {
    row: el("div", { class: "field field-vector", role: "group", "aria-label": label },
      el("span", { class: "label" }, label, unit && el("small", {}, ` ${unit}`)), inputs),
    set(v) {
      current = [...v];
      inputs.forEach((input, i) => {
        if (!isFocused(input)) input.value = number(v[i]);
      });
    },
  };
}

/** A colour, linear Rec.709 to the outside. */
export function colorField({ label, value, onchange }) {
  const id = freshId();
  const input = el("input", { type: "color", id, value: hexFromLinear(value) });
  const shown = el("output", { for: id, class: "code" }, hexFromLinear(value));
  input.addEventListener("input", () => {
    shown.textContent = input.value;
    onchange(linearFromHex(input.value));
  });
  return {
    row: el("div", { class: "field field-color" }, el("label", { for: id }, label), input, shown),
    set(v) {
      if (isFocused(input)) return;
      input.value = hexFromLinear(v);
      shown.textContent = input.value;
    },
  };
}

/** One of several; options are [value, text] or plain values. */
export function selectField({ label, options, value, onchange, hint }) {
  const id = freshId();
  const select = el("select", { id, title: hint }, options.map((option) => {
    const [key, text] = Array.isArray(option) ? option : [option, option];
    return el("option", { value: key }, text);
  }));
  select.value = value;
  select.addEventListener("change", () => onchange(select.value));
  return {
    row: el("div", { class: "field" }, el("label", { for: id }, label), select),
    set(v) {
      select.value = v;
    },
  };
}

export function checkField({ label, value, onchange }) {
  const id = freshId();
  const input = el("input", { type: "checkbox", id, checked: value });
  input.addEventListener("change", () => onchange(input.checked));
  return {
    row: el("div", { class: "field field-check" }, input, el("label", { for: id }, label)),
    set(v) {
      input.checked = v;
    },
  };
}

/** A part of a panel under a heading. */
export function group(title, ...children) {
  return el("section", { class: "group" }, el("h3", {}, title), children);
}

/** Facts: [[name, value], ...]. */
export function facts(rows) {
  return el("dl", { class: "facts" },
    rows.filter(Boolean).map(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]));
}

export function empty(name, text) {
  return el("div", { class: "empty" }, icon(name, 28), el("p", {}, text));
}
