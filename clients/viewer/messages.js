// SPDX-License-Identifier: MIT
// What the server refuses, in words, where it can be seen and heard until it is closed.
import { announce, byId, button, el, icon } from "./dom.js";

const SHOWN_MAX = 3;
const NOTICE_MS = 4000;

/** "/quality/shadows" as "quality › shadows". */
const placeOf = (pointer) => pointer.split("/").slice(1).join(" › ");

/** @param {Error} problem a VitrailError, or any other error @param {string} [what] was tried */
export function showProblem(problem, what) {
  const box = byId("messages");
  const key = `${problem.code ?? ""}${problem.message}`;
  for (const shown of box.children) if (shown.dataset.key === key) return; // once is enough
  const place = problem.pointer ? placeOf(problem.pointer) : "";
  const facts = problem.code === "no_reply" ? "" : [problem.status ? `${problem.status} ${problem.code}` : problem.code, place,
    problem.requestId && `request ${problem.requestId}`].filter(Boolean).join(" · ");
  const message = el("div", { class: "message", "data-key": key, "data-code": problem.code },
    icon("warning", 18),
    el("div", { class: "message-text" },
      el("strong", {}, what ?? problem.title ?? "Something went wrong"),
      el("p", {}, problem.message), facts && el("p", { class: "fine" }, facts)),
    button({ label: "Dismiss", icon: "close", class: "plain", onclick: () => message.remove() }));
  box.append(message);
  while (box.children.length > SHOWN_MAX) box.firstChild.remove();
}

export function clearProblems() {
  byId("messages").replaceChildren();
}

/** What could not be done while the server was away is old news. */
export function clearUnreached() {
  for (const shown of [...byId("messages").children]) if (shown.dataset.code === "no_reply") shown.remove();
}

/** A short word of success in the status line, and to screen readers. */
export function notice(text) {
  const note = byId("status-note");
  note.textContent = text;
  announce(text);
  clearTimeout(note.timer);
  note.timer = setTimeout(() => {
    note.textContent = "";
  }, NOTICE_MS);
}
