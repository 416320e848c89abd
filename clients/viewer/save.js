// SPDX-License-Identifier: MIT
// The picture as a file, at any size, and a link to the view.
import { button, byId, el, replace } from "./dom.js";
import { numberField, selectField } from "./fields.js";
import { refinedQuality } from "./live.js";
import { notice, showProblem } from "./messages.js";
import { wordsOf } from "./progress.js";

const TYPES = { png: "image/png", jpeg: "image/jpeg", webp: "image/webp", exr: "image/x-exr" };
const SIDE_MAX = 16384;

function download(blob, name) {
  const url = URL.createObjectURL(blob);
  el("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

/** Opens the dialogue; wanted is the request of the picture that shows. */
export function openSave(client, wanted, name) {
  const dialog = byId("help");
  const chosen = { format: "png", width: wanted.width, height: wanted.height, aov: "color" };
  const save = async () => {
    const { stream: _, ...request } = wanted;
    const output = { width: Math.round(chosen.width), height: Math.round(chosen.height),
      format: chosen.format, output: chosen.aov, quality: refinedQuality(wanted) ?? wanted.quality };
    go.disabled = true;
    go.querySelector("span").textContent = "Rendering …";
    try {
      const onProgress = (progress) => (go.querySelector("span").textContent = wordsOf(progress));
      const { blob } = await client.render({ ...request, ...output },
        { accept: TYPES[chosen.format], onProgress });
      download(blob, `${name}${chosen.aov === "color" ? "" : `-${chosen.aov}`}.${chosen.format}`);
      notice("The picture is saved");
      dialog.close();
    } catch (problem) {
      showProblem(problem, "The picture was not saved");
      dialog.close();
    }
  };
  const go = button({ text: "Save", icon: "save", class: "primary", onclick: save });
  const size = (member, label) => numberField({ label, unit: "px", least: 1, most: SIDE_MAX,
    value: chosen[member], onchange: (value) => (chosen[member] = value) }).row;
  replace(dialog, el("h2", { id: "help-title" }, "Save the picture"),
    selectField({ label: "Format", value: "png", options: [["png", "PNG"], ["exr", "EXR, linear"],
      ["webp", "WebP"], ["jpeg", "JPEG"]], onchange: (value) => (chosen.format = value) }).row,
    selectField({ label: "Content", value: "color", options: [["color", "Colour"], ["depth", "Depth"],
      ["normal", "Normal"], ["albedo", "Base colour"],
      ["transmittance", "Transmittance"], ["lights", "Lights, as a heat map"],
      ["layers", "Transparent layers, as a heat map"], ["optical_depth", "Optical depth"]], onchange: (value) => (chosen.aov = value) }).row,
    size("width", "Width"), size("height", "Height"),
    el("div", { class: "row row-end" },
      button({ text: "Cancel", onclick: () => dialog.close() }), go));
  dialog.showModal();
}

/** Puts the address of the view where it can be passed on. */
export async function shareLink(url) {
  try {
    await navigator.clipboard.writeText(url);
    notice("The link is copied");
  } catch {
    const dialog = byId("help"); // no clipboard without a secure origin
    replace(dialog, el("h2", { id: "help-title" }, "Link to this view"),
      el("input", { type: "text", readOnly: true, value: url, "aria-label": "Link",
        onfocus: (event) => event.target.select() }),
      el("div", { class: "row row-end" }, button({ text: "Close", onclick: () => dialog.close() })));
    dialog.showModal();
  }
}

const POLL_MS = 700;

/** Has the server measure time against error for the view that shows; closed, that goes on. */
export async function openTradeoff(client, wanted) {
  const dialog = byId("help");
  const { stream: _, quality: { max_error: __, budget_ms: ___, reference: ____, ...quality },
    ...request } = wanted;
  const bar = el("progress", { max: 1, value: 0, "aria-label": "Measured" });
  const said = el("p", { class: "fine", role: "status" }, "Asking the server …");
  const results = el("p");
  let found = null;
  const cancel = async () => {
    stop.disabled = true;
    try {
      await client.cancelTradeoff(found.id);
    } catch (problem) {
      showProblem(problem, "The measurement goes on");
    }
  };
  const stop = button({ text: "Stop measuring", onclick: cancel });
  stop.disabled = true; // until it has begun
  replace(dialog, el("h2", { id: "help-title" }, "Time against error"),
    el("p", {}, "Every technique is timed and compared with a ray-traced reference. Afterwards "
      + "“Max error” and “Budget” choose by what was measured. This takes minutes."),
    bar, said, results, el("div", { class: "row row-end" },
      stop, button({ text: "Close", class: "primary", onclick: () => dialog.close() })));
  dialog.showModal();
  try {
    found = await client.createTradeoff({ ...request, quality });
    stop.disabled = false;
    replace(results, el("a", { href: `/v1/tradeoffs/${found.id}?format=html`, target: "_blank",
      rel: "noopener" }, "Results so far, on a page of their own"));
    while (dialog.open && bar.isConnected && ["queued", "running"].includes(found.state)) {
      await new Promise((done) => setTimeout(done, POLL_MS));
      found = await client.tradeoff(found.id);
      bar.value = found.progress;
      said.textContent = `${found.state}, ${found.stage}: ${Math.round(100 * found.progress)} %`;
    }
    stop.disabled = true;
  } catch (problem) {
    if (bar.isConnected) dialog.close();
    showProblem(problem, "Nothing was measured");
  }
}

const KEYS = [
  ["Drag", "orbit"], ["Right or middle drag, Shift drag", "pan"], ["Wheel, pinch, Ctrl drag", "zoom"],
  ["Click", "select what is there"], ["Double click", "orbit around that point"],
  ["Arrow keys", "orbit; with Shift pan"], ["+  −", "zoom"], ["W A S D  Q E", "fly"],
  ["F", "fit the selection, or all"], ["1  2  3  4", "front, right, top, isometric"],
  ["G", "handles to move, turn and scale what is selected"],
  ["Shift while dragging a handle", "in steps: 15°, round lengths"], ["O", "orthographic or perspective"], ["H", "hide what is selected"], ["C", "compare"],
  ["Space  ,  .", "play or pause, a step back, a step on"], ["M", "maps: transparent layers, lights, none"], ["I", "statistics"], ["Enter", "select what is in the middle"], ["Esc", "clear the selection"],
  ["Ctrl Z, Ctrl Shift Z", "undo, redo"],
];

export function openHelp(capabilities) {
  const dialog = byId("help");
  const title = el("h2", { id: "help-title", tabIndex: -1, autofocus: true }, "Keys and gestures");
  replace(dialog, title, // has the focus first, so that reading begins at the top
    el("p", { class: "fine" }, "Keys work while the picture has the focus."),
    el("table", { class: "keys" }, el("tbody", {}, KEYS.map(([key, does]) =>
      el("tr", {}, el("th", { scope: "row" }, key), el("td", {}, does))))),
    capabilities && el("p", { class: "fine" },
      `Vitrail ${capabilities.version} on ${capabilities.device?.renderer ?? "no device"}`),
    el("div", { class: "row row-end" },
      button({ text: "Close", class: "primary", onclick: () => dialog.close() })));
  dialog.showModal();
}
