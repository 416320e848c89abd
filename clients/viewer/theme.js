// SPDX-License-Identifier: MIT
// Light colours, dark ones, or those of the system; the browser remembers the choice.
const KEY = "vitrail-theme";
const ORDER = ["auto", "light", "dark"];

function set(theme) {
  document.documentElement.dataset.theme = theme;
  try {
    localStorage.setItem(KEY, theme);
  } catch {
    // a browser that keeps nothing: the choice lasts as long as the page
  }
}

/** Takes the colours that were chosen last. */
export function restoreTheme() {
  let stored = null;
  try {
    stored = localStorage.getItem(KEY);
  } catch {
    // a browser that keeps nothing
  }
  set(ORDER.includes(stored) ? stored : "auto");
}

/** Takes the next colours; answers their name for people. */
export function nextTheme() {
  const at = ORDER.indexOf(document.documentElement.dataset.theme);
  const theme = ORDER[(at + 1) % ORDER.length];
  set(theme);
  return theme === "auto" ? "as the system" : theme;
}
