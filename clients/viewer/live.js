// SPDX-License-Identifier: MIT
// Keeps one picture in step with one description of it, by the best line there is: a WebSocket, else
// a multipart stream with patches beside it, else still images. Every line drops what is overtaken.
import { isSame, mergePatch, viewPatch } from "./members.js";
import { VitrailError } from "./vitrail.js";

const REST_MS = 180; // without a change for so long, the exact picture is due
const RETRY_MS = [500, 1000, 2000, 5000, 10000];
const MESSAGE_CHARS = 300_000; // up the socket, which takes 1 MiB; what is longer goes as a request
export const VIEW_OPTIONS = { expires_s: 60 }; // the end of a page may reach nobody
const TRIES = 2; // of a line that never showed a frame, before another kind is taken

/** What all lines have in common. Events: "frame", "progress", "problem", "lost"; details below. */
class Line extends EventTarget {
  constructor(client) {
    super();
    this.client = client;
    this.isClosed = false;
    this.hasShown = false; // a frame, once
  }

  tell(type, detail) {
    if (this.isClosed) return;
    if (type === "frame") this.hasShown = true;
    const event = new Event(type);
    event.detail = detail;
    this.dispatchEvent(event);
  }

  close() {
    this.isClosed = true;
  }
}

/** Frames and edits over one WebSocket. */
class SocketLine extends Line {
  static label = "live";
  hasOpened = false;
  isWaiting = false; // for a request: nothing is sent meanwhile

  async open(wanted) {
    this.sent = wanted;
    this.view = await this.client.createView(wanted, VIEW_OPTIONS);
    if (this.isClosed) return this.#forget();
    this.socket = this.view.socket();
    this.socket.addEventListener("open", () => {
      this.hasOpened = true;
      this.tell("open");
      this.update(this.wanted ?? wanted);
    });
    this.socket.addEventListener("frame", (event) => this.#take(event.detail));
    this.socket.addEventListener("problem", ({ detail }) => {
      if (detail.id !== null) this.#lookAgain();
      this.tell("problem", detail);
    });
    this.socket.addEventListener("progress", (event) => this.tell("progress", event.detail));
    this.socket.addEventListener("close", (event) => this.tell("lost", event.detail));
  }

  async #take({ header, blob }) {
    const bitmap = await createImageBitmap(blob).catch(() => null);
    this.socket.ack();
    if (!bitmap) return;
    this.tell("frame", { bitmap, isExact: header.exact, isRefined: header.refined,
      width: header.width, height: header.height, scale: header.scale, frame: header.frame,
      timings: header.timings_ms, bytes: header.bytes, revision: header.revision });
  }

  update(wanted) {
    this.wanted = wanted;
    if (!this.socket?.isOpen || !this.hasOpened || this.isWaiting) return;
    const { camera: before, ...sentRest } = this.sent;
    const { camera, ...rest } = wanted;
    const patch = viewPatch(sentRest, rest);
    if (patch && JSON.stringify(patch).length > MESSAGE_CHARS) {
      this.#patchLong(patch, wanted);
      return;
    }
    if (patch) this.socket.patch(patch, 1);
    if (mergePatch(before, camera)) this.socket.camera(camera);
    this.sent = wanted;
  }

  /** What is too long for a message goes as a request, and messages wait for it. */
  async #patchLong(patch, wanted) {
    const sent = { ...wanted, camera: this.sent.camera };
    this.isWaiting = true;
    try {
      await this.view.patch(patch);
      this.sent = sent;
      this.isWaiting = false;
      this.update(this.wanted);
    } catch (problem) {
      this.isWaiting = false;
      this.tell("problem", problem);
      this.#lookAgain();
    }
  }

  /** A message was refused, and those behind it perhaps not: goes on from what the view is, once
   * something else is wanted. */
  async #lookAgain() {
    if (this.isWaiting) return;
    const refused = this.wanted;
    this.isWaiting = true;
    this.sent = (await this.view.get().catch(() => null))?.view ?? this.sent;
    this.isWaiting = false;
    if (this.wanted !== refused) this.update(this.wanted);
  }

  close() {
    super.close();
    this.socket?.close();
    this.#forget();
  }

  #forget() {
    this.view?.delete().catch(() => {}); // it expires by itself
  }
}

/** Frames as a multipart stream, edits as patches, one at a time. */
class StreamLine extends Line {
  static label = "stream";
  abort = new AbortController();

  async open(wanted) {
    this.sent = wanted;
    this.wanted = wanted;
    this.view = await this.client.createView(wanted, VIEW_OPTIONS);
    if (this.isClosed) this.#forget();
    else this.#read();
  }

  async #read() {
    try {
      for await (const part of this.view.stream({ signal: this.abort.signal })) {
        const { problem, blob, ...frame } = part;
        if (problem) {
          this.tell("problem", problem);
          continue;
        }
        if (!this.hasShown) this.tell("open");
        const bitmap = await createImageBitmap(blob);
        this.tell("frame", { ...frame, bitmap, width: bitmap.width, height: bitmap.height,
          bytes: blob.size, timings: {} });
      }
      this.tell("lost", {});
    } catch {
      this.tell("lost", {});
    }
  }

  async update(wanted) {
    this.wanted = wanted;
    if (this.isBusy || !this.view) return;
    this.isBusy = true;
    try {
      while (!this.isClosed) {
        const next = this.wanted;
        const patch = viewPatch(this.sent, next);
        if (!patch) break;
        if (patch.camera) patch.camera = { ortho_height: null, ...next.camera };
        await this.view.patch(patch);
        this.sent = next;
      }
    } catch (problem) {
      this.tell("problem", problem);
    }
    this.isBusy = false;
  }

  close() {
    super.close();
    this.abort.abort();
    this.#forget();
  }

  #forget() {
    this.view?.delete().catch(() => {}); // it expires by itself
  }
}

/** That of the picture at rest, where the server refines it with the samples that `stream` wants;
 * else null. */
export function refinedQuality({ quality = {}, stream = {} }) {
  const isOther = quality.reference || quality.max_error || quality.budget_ms;
  const isRefined = !isOther && stream.rest_samples > (quality.samples || 4);
  return isRefined ? { ...quality, samples: stream.rest_samples } : null;
}

/** One render after the other: small and quick while things move, exact at rest, then refined. */
class StillLine extends Line {
  static label = "stills";
  scale = 0.5;

  async open(wanted) {
    this.update(wanted);
  }

  update(wanted) {
    this.wanted = wanted;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#render(true), REST_MS);
    this.#render(false);
  }

  async #render(isExact, refined = null) {
    if (this.isBusy || this.isClosed) {
      this.isOverdue = true;
      return;
    }
    this.isBusy = true;
    this.isOverdue = false;
    const { stream: { budget_ms: budget }, ...wanted } = this.wanted;
    const request = refined ? { ...wanted, quality: refined } : isExact ? wanted : this.#quick(wanted);
    let better = null;
    const started = performance.now();
    try {
      const isColor = (request.output ?? "color") === "color"; // others would lose their meaning
      const accept = isExact || !isColor ? "image/png" : "image/jpeg";
      const { blob, frame, timings } = await this.client.render(request, { accept });
      const bitmap = await createImageBitmap(blob);
      const took = performance.now() - started;
      if (!isExact)
        this.scale = Math.min(1, Math.max(0.2, this.scale * Math.sqrt(budget / took)));
      if (!this.hasShown) this.tell("open");
      this.tell("frame", { bitmap, isExact, isRefined: refined !== null, width: request.width,
        height: request.height, frame, scale: request.width / wanted.width, timings,
        bytes: blob.size, revision: null });
      better = isExact && isColor && !refined ? refinedQuality(this.wanted) : null;
    } catch (problem) {
      this.tell(problem.status === 0 ? "lost" : "problem", problem);
    }
    this.isBusy = false;
    if (this.isOverdue) this.update(this.wanted);
    else if (better) this.#render(true, better);
  }

  #quick(wanted) {
    const side = (pixels) => Math.max(16, Math.round(pixels * this.scale));
    return { ...wanted, width: side(wanted.width), height: side(wanted.height),
      quality: { ...wanted.quality, samples: 1, shadow_taps: 1 } };
  }

  close() {
    super.close();
    clearTimeout(this.timer);
  }
}

const LINES = [SocketLine, StreamLine, StillLine];
export const STILLS = LINES.indexOf(StillLine);

/**
 * The picture of what is wanted. Events: "frame" {bitmap, isExact, isRefined, width, height, scale, frame,
 * timings, bytes}, "progress" {stage, share, left_s} of a long one, by sockets alone, "problem" VitrailError, "state" {state: "on" | "off" | "wait", label, isLost}: lost, it tries again.
 */
export class Live extends EventTarget {
  #line = null;
  #kind;
  #tries = 0;
  #failures = 0;
  #timer;
  #wanted = null;

  /** @param {number} [kind] the first line to try: 0 socket, 1 stream, 2 stills */
  constructor(client, kind = 0) {
    super();
    this.client = client;
    this.#kind = kind;
  }

  #tell(type, detail) {
    const event = new Event(type);
    event.detail = detail;
    this.dispatchEvent(event);
  }

  get view() {
    return this.#line?.view ?? null;
  }

  /** Shows this from now on: all members of a view. Another scene takes another view. False when it
   * is what shows already: no frame follows. */
  show(wanted) {
    if (this.#wanted && isSame(wanted, this.#wanted)) return false;
    const isOther = wanted.scene !== this.#wanted?.scene;
    this.#wanted = wanted;
    if (isOther || !this.#line) this.#open();
    else this.#line.update(wanted);
    return true;
  }

  stop() {
    clearTimeout(this.#timer);
    this.#line?.close();
    this.#line = null;
    this.#wanted = null;
  }

  /** Tries to reach the server now, where it would later. */
  retry() {
    if (this.#wanted && this.#line?.isClosed) this.#open();
  }

  #open() {
    clearTimeout(this.#timer);
    this.#line?.close();
    const line = new LINES[this.#kind](this.client);
    this.#line = line;
    this.#tell("state", { state: "wait", label: "connecting" });
    line.addEventListener("open", () => {
      this.#failures = 0;
      this.#tell("state", { state: "on", label: LINES[this.#kind].label });
    });
    line.addEventListener("frame", (event) => {
      this.#tries = 0;
      this.#tell("frame", event.detail);
    });
    line.addEventListener("problem", (event) => this.#tell("problem", event.detail));
    line.addEventListener("progress", (event) => this.#tell("progress", event.detail));
    line.addEventListener("lost", () => this.#lost(line));
    line.open(this.#wanted).catch((problem) => this.#refused(line, problem));
  }

  /** No view: say why; try again where that can help. Without a line, the next change tries. */
  #refused(line, problem) {
    if (line.isClosed) return;
    if (problem.status === 0 || problem.status === 503) {
      this.#lost(line);
      return;
    }
    line.close();
    this.#line = null;
    this.#tell("state", { state: "off", label: "refused" });
    this.#tell("problem", problem);
  }

  /** Where there was no view, the server was not there or had no room: no fault of the line. */
  #lost(line) {
    line.close();
    const hasFailed = line.view && !line.hasShown;
    if (hasFailed && ++this.#tries >= TRIES && this.#kind + 1 < LINES.length) {
      this.#kind++;
      this.#tries = 0;
    }
    const delay = RETRY_MS[Math.min(this.#failures++, RETRY_MS.length - 1)];
    this.#tell("state", { state: "off", label: "reconnecting", isLost: true });
    this.#timer = setTimeout(() => this.#wanted && this.#open(), delay);
  }
}
