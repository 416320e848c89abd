// SPDX-License-Identifier: MIT
// Linear Rec.709, which the service speaks, to and from sRGB, which colour pickers speak.
// Transfer functions: IEC 61966-2-1.

export function linearFromSrgb(value) {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

export function srgbFromLinear(value) {
  const kept = Math.min(1, Math.max(0, value));
  return kept <= 0.0031308 ? 12.92 * kept : 1.055 * kept ** (1 / 2.4) - 0.055;
}

/** [r, g, b] linear, 0 to 1 (more is clamped), as "#rrggbb". */
export function hexFromLinear(rgb) {
  const digits = rgb.slice(0, 3).map((value) =>
    Math.round(255 * srgbFromLinear(value)).toString(16).padStart(2, "0"));
  return `#${digits.join("")}`;
}

/** "#rrggbb" as linear [r, g, b] with as many digits as eight bits hold. */
export function linearFromHex(hex) {
  return [1, 3, 5].map((at) =>
    Number(linearFromSrgb(parseInt(hex.slice(at, at + 2), 16) / 255).toPrecision(6)));
}

/** Linear [r, g, b] as a style sheet says it. */
export const cssColor = ([r, g, b]) => `color(srgb-linear ${r} ${g} ${b})`;
