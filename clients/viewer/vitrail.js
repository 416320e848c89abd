// SPDX-License-Identifier: MIT
/**
 * The Vitrail client for JavaScript: scenes, renders, views, stats. For browsers and for Node 18 and
 * newer; no dependencies. Its manual, with examples, is docs/reference/javascript.md.
 */

const LOOK_MS = 500; // between two looks at how far a render is

/** A reply that says no: the members of its problem (RFC 9457). */
export class VitrailError extends Error {
  /** @param {object} problem members as in docs/reference/http.md; what is missing is filled in */
  constructor(problem) {
    super(problem.detail || problem.title || `status ${problem.status}`);
    this.name = "VitrailError";
    this.status = problem.status ?? 0; // 0: there was no reply
    this.code = problem.code ?? "no_reply";
    this.title = problem.title ?? "";
    this.detail = problem.detail ?? "";
    this.pointer = problem.pointer ?? null;
    this.requestId = problem.request_id ?? null;
    this.revision = problem.revision ?? null;
    this.id = problem.id ?? null; // of a socket's message that is refused
  }
}

/**
 * A `.glb` that shows one density grid, smoke say, for `postScene`.
 * @param {ArrayLike<number>} values densities at the centres of voxels: x first, then y, then z
 * @param {number[]} size voxels along x, y and z
 * @param {{min: number[], max: number[], name?: string, density?: number, color?: number[],
 *   extinction?: number[], anisotropy?: number}} look the corners of the box [m], and what a grid
 *   of VITRAIL_density_grids has (docs/reference/scene-formats.md)
 */
export function densityGrid(values, size, { name = "smoke", ...look }) {
  const count = size.reduce((product, side) => product * side, 1);
  if (size.length !== 3 || count !== values.length)
    throw new RangeError(`${values.length} values in a grid of ${size.join(" x ")}`);
  const text = new TextEncoder().encode(JSON.stringify({
    asset: { version: "2.0" }, extensionsUsed: ["VITRAIL_density_grids"],
    extensions: { VITRAIL_density_grids: { grids: [{ name, size, values: 0, ...look }] } },
    scene: 0, scenes: [{ nodes: [0] }],
    nodes: [{ name, extensions: { VITRAIL_density_grids: { grid: 0 } } }],
    accessors: [{ bufferView: 0, componentType: 5126, type: "SCALAR", count }],
    bufferViews: [{ buffer: 0, byteLength: 4 * count }], buffers: [{ byteLength: 4 * count }],
  }));
  const begin = 28 + Math.ceil(text.length / 4) * 4; // of the numbers
  const glb = new DataView(new ArrayBuffer(begin + 4 * count));
  const head = [0x46546c67, 2, glb.byteLength, begin - 28, 0x4e4f534a];
  head.forEach((word, i) => glb.setUint32(4 * i, word, true));
  new Uint8Array(glb.buffer, 20, begin - 28).fill(0x20).set(text);
  glb.setUint32(begin - 8, 4 * count, true);
  glb.setUint32(begin - 4, 0x004e4942, true);
  for (let i = 0; i < count; i++) glb.setFloat32(begin + 4 * i, values[i], true);
  return new Blob([glb.buffer], { type: "model/gltf-binary" });
}

/** "queue;dur=0.1, total;dur=9" as {queue: 0.1, total: 9}. */
export function parseServerTiming(header) {
  const found = {};
  for (const part of (header ?? "").split(",")) {
    const [name, ...parameters] = part.trim().split(";");
    const duration = parameters.find((parameter) => parameter.trim().startsWith("dur="));
    if (name && duration) found[name] = Number(duration.trim().slice(4));
  }
  return found;
}

async function errorOf(response) {
  const text = await response.text().catch(() => "");
  let problem = {};
  try {
    problem = JSON.parse(text);
  } catch {
    problem = { detail: `the server answered ${response.status} ${response.statusText}` };
  }
  return new VitrailError({ ...problem, status: response.status });
}

function queryOf(members) {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries(members))
    if (value !== undefined && value !== null) query.set(name, String(value));
  const text = query.toString();
  return text ? `?${text}` : "";
}

/** The image of a reply with what its headers say of it. */
async function imageOf(response) {
  return {
    blob: response.status === 304 ? null : await response.blob(), // null: not changed
    etag: response.headers.get("ETag"),
    revision: Number(response.headers.get("X-View-Revision")) || null,
    frame: /\/v1\/frames\/([^>]+)>/.exec(response.headers.get("Link") ?? "")?.[1] ?? null,
    timings: parseServerTiming(response.headers.get("Server-Timing")),
  };
}

/** Position of a needle in bytes, from some place on; -1 when it is not there. */
function find(bytes, needle, from) {
  for (let at = bytes.indexOf(needle[0], from); at >= 0; at = bytes.indexOf(needle[0], at + 1))
    if (needle.every((byte, i) => bytes[at + i] === byte)) return at;
  return -1;
}

/** The parts of a multipart body that says the length of each: {headers, content}. */
async function* partsOf(body) {
  const reader = body.getReader();
  const headEnd = [13, 10, 13, 10];
  let held = new Uint8Array(0);
  const more = async () => {
    const { value, done } = await reader.read();
    if (done) return false;
    const grown = new Uint8Array(held.length + value.length);
    grown.set(held);
    grown.set(value, held.length);
    held = grown;
    return true;
  };
  try {
    for (;;) {
      let end = find(held, headEnd, 0);
      for (; end < 0; end = find(held, headEnd, 0)) if (!(await more())) return;
      const lines = new TextDecoder().decode(held.subarray(0, end)).split("\r\n");
      const headers = new Map(lines.filter((line) => line.includes(":")).map((line) =>
        [line.slice(0, line.indexOf(":")).toLowerCase(), line.slice(line.indexOf(":") + 1).trim()]));
      const start = end + headEnd.length;
      const length = Number(headers.get("content-length"));
      while (held.length < start + length) if (!(await more())) return;
      yield { headers, content: held.slice(start, start + length) };
      held = held.slice(start + length);
    }
  } finally {
    reader.cancel().catch(() => {});
  }
}

/** One server. All methods throw VitrailError when the server says no or is not there. */
export class Vitrail {
  /** @param {string} [url] of the server; "" is the one this page came from */
  constructor(url = "") {
    this.url = url.replace(/\/+$/, "");
  }

  /** A request as fetch does it, with failures as VitrailError. */
  async request(path, { method = "GET", headers = {}, body, signal, keepalive } = {}) {
    let response;
    try {
      response = await fetch(this.url + path, { method, headers, body, signal, keepalive });
    } catch (failure) {
      if (failure.name === "AbortError") throw failure;
      throw new VitrailError({ detail: "the server cannot be reached" });
    }
    if (!response.ok && response.status !== 304) throw await errorOf(response);
    return response;
  }

  async json(path, options) {
    return (await this.request(path, options)).json();
  }

  async send(method, path, members, { type = "application/json", headers = {}, signal } = {}) {
    const body = JSON.stringify(members);
    return this.request(path, { method, body, headers: { "Content-Type": type, ...headers }, signal });
  }

  // ---- what there is ----

  capabilities() {
    return this.json("/v1/capabilities");
  }

  stats() {
    return this.json("/v1/stats");
  }

  /** True when a render would be served now. */
  async isReady() {
    return (await fetch(`${this.url}/readyz`).catch(() => null))?.ok ?? false;
  }

  /** The report of a frame: passes, counts, bytes, warnings. */
  frame(id) {
    return this.json(`/v1/frames/${encodeURIComponent(id)}`);
  }

  // ---- scenes ----

  /** The scenes, oldest first. */
  async scenes() {
    return (await this.json("/v1/scenes")).scenes;
  }

  /** What a scene holds. */
  scene(id) {
    return this.json(`/v1/scenes/${id}`);
  }

  /** Nodes, materials, lights and cameras of a scene, with their values. */
  outline(id) {
    return this.json(`/v1/scenes/${id}/outline`);
  }

  /** @param {string|null} name null takes the name away */
  async renameScene(id, name) {
    return this.json(`/v1/scenes/${id}`, { method: "PATCH",
      headers: { "Content-Type": "application/merge-patch+json" }, body: JSON.stringify({ name }) });
  }

  /** @param {{force?: boolean}} [options] force: also one that a job needs which has not ended */
  async deleteScene(id, { force } = {}) {
    await this.request(`/v1/scenes/${id}${queryOf({ force })}`, { method: "DELETE" });
  }

  /**
   * Brings a scene: one GLB, or files of which one is the scene. Answers its summary;
   * posting the same content again is harmless.
   * @param {Blob|{name: string, blob: Blob}[]} content files are named as the .gltf refers to them
   * @param {{scene?: string, unit?: string, up?: string, deflection?: number, onProgress?: (share: number) => void,
   *   onReading?: (progress: {stage: string, share: number}) => void,
   *   signal?: AbortSignal}} [options]
   *   scene: which of the file, by its name or "#1", its index, of OpenVDB which grid; unit, up: how a file that is not
   *   glTF is read: mm, cm, m, in or ft; y or z; deflection: how far triangles of STEP and IGES may
   *   be off their surfaces, in units of the file; onProgress: how much is sent; onReading: called
   *   twice a second while the server reads what was sent
   */
  async postScene(content, { scene, unit, up, deflection, onProgress, onReading, signal } = {}) {
    const query = queryOf({ scene: scene || null, unit: unit || null, up: up || null,
      deflection: deflection || null });
    const path = `/v1/scenes${query}`;
    let body = content;
    const headers = {};
    if (content instanceof Blob) headers["Content-Type"] = "model/gltf-binary";
    else {
      body = new FormData(); // its boundary is the runtime's to write
      for (const { name, blob } of content) body.append(name, blob, name);
    }
    const watch = onReading ? this.#watch("uploads", headers, onReading) : null;
    try {
      return await this.#post(path, headers, body, onProgress, signal);
    } finally {
      watch?.abort();
    }
  }

  #post(path, headers, body, onProgress, signal) {
    if (!onProgress || typeof XMLHttpRequest === "undefined")
      return this.json(path, { method: "POST", headers, body, signal });
    return this.#postWithProgress(path, headers, body, onProgress, signal);
  }

  /** The environment maps, oldest first. */
  async environments() {
    return (await this.json("/v1/environments")).environments;
  }

  /** What an environment map holds. */
  environment(id) {
    return this.json(`/v1/environments/${id}`);
  }

  /**
   * Brings an environment map, Radiance HDR or OpenEXR. Answers its summary, whose id goes into
   * `environment.image`; posting the same content again is harmless.
   * @param {Blob} blob
   * @param {{name?: string, onProgress?: (share: number) => void, signal?: AbortSignal}} [options]
   */
  postEnvironment(blob, { name, onProgress, signal } = {}) {
    const headers = { "Content-Type": "application/octet-stream" };
    const path = `/v1/environments${queryOf({ name: name || null })}`;
    return this.#post(path, headers, blob, onProgress, signal);
  }

  /** @param {string|null} name null takes the name away */
  async renameEnvironment(id, name) {
    return (await this.send("PATCH", `/v1/environments/${id}`, { name })).json();
  }

  async deleteEnvironment(id, { force } = {}) {
    await this.request(`/v1/environments/${id}${queryOf({ force })}`, { method: "DELETE" });
  }

  /**
   * Has the server make its demo scene; answers its summary.
   * @param {{signal?: AbortSignal}} [options]
   */
  postDemo({ signal } = {}) {
    return this.json("/v1/scenes/demo", { method: "POST", signal });
  }

  #postWithProgress(path, headers, body, onProgress, signal) {
    return new Promise((resolve, reject) => {
      const request = new XMLHttpRequest();
      request.open("POST", this.url + path);
      for (const [name, value] of Object.entries(headers)) request.setRequestHeader(name, value);
      request.upload.onprogress = (event) => onProgress(event.loaded / Math.max(1, event.total));
      request.onerror = () => reject(new VitrailError({ detail: "the upload was broken off" }));
      request.onabort = () => reject(new DOMException("the upload was cancelled", "AbortError"));
      request.onload = () => {
        let reply = {};
        try {
          reply = JSON.parse(request.responseText);
        } catch {
          reply = { detail: `the server answered ${request.status}` };
        }
        if (request.status < 300) resolve(reply);
        else reject(new VitrailError({ ...reply, status: request.status }));
      };
      signal?.addEventListener("abort", () => request.abort(), { once: true });
      request.send(body);
    });
  }

  // ---- images ----

  /**
   * Renders one image.
   * @param {object} request as in docs/reference/requests.md
   * @param {{accept?: string, etag?: string, signal?: AbortSignal,
   *   onProgress?: (progress: {stage: string, share: number, left_s: number|null}) => void}} [options]
   *   etag: as the last image had it; when nothing changed, the answer's blob is null.
   *   onProgress: called twice a second while an image takes long
   */
  async render(request, { accept = "image/png", etag, signal, onProgress } = {}) {
    const headers = { Accept: accept, ...(etag ? { "If-None-Match": etag } : {}) };
    const watch = onProgress ? this.#watch("renders", headers, onProgress) : null;
    try {
      return await imageOf(await this.send("POST", "/v1/renders", request, { headers, signal }));
    } finally {
      watch?.abort();
    }
  }

  /** What is done with a render, or an image of a view, that was asked for with that X-Request-Id. */
  renderStatus(id, { signal } = {}) {
    return this.json(`/v1/renders/${encodeURIComponent(id)}`, { signal });
  }

  /** How far the reading of an upload is that was sent with that X-Request-Id. */
  uploadStatus(id, { signal } = {}) {
    return this.json(`/v1/uploads/${encodeURIComponent(id)}`, { signal });
  }

  /** Gives the request an id, and looks at it until the controller that this answers is aborted. */
  #watch(what, headers, onProgress) {
    const part = () => Math.random().toString(36).slice(2);
    const id = `js-${part()}${part()}`;
    const watch = new AbortController();
    const look = async () => {
      const status = await this.json(`/v1/${what}/${id}`, { signal: watch.signal })
        .catch(() => null); // not there yet, or ended
      if (!watch.signal.aborted && status?.progress) onProgress(status.progress);
    };
    const timer = setInterval(look, LOOK_MS);
    watch.signal.addEventListener("abort", () => clearInterval(timer), { once: true });
    headers["X-Request-Id"] = id;
    return watch;
  }

  // ---- jobs: lists of frames ----

  /** The jobs, newest first. */
  async jobs() {
    return (await this.json("/v1/jobs")).jobs;
  }

  /** State, progress, failures and request of one. */
  job(id) {
    return this.json(`/v1/jobs/${id}`);
  }

  /**
   * Has frames rendered, whatever ends meanwhile; members as in docs/reference/jobs.md.
   * @param {{key?: string}} [options] key: sent again with the same key, it is the same job
   */
  async createJob(request, { key } = {}) {
    const headers = key ? { "Idempotency-Key": key } : {};
    return (await this.send("POST", "/v1/jobs", request, { headers })).json();
  }

  /** @param {{paused?: boolean, priority?: number, retry_failed?: boolean}} change */
  async changeJob(id, change) {
    return (await this.send("PATCH", `/v1/jobs/${id}`, change)).json();
  }

  /** No more frames; those that are done stay. */
  cancelJob(id) {
    return this.json(`/v1/jobs/${id}`, { method: "DELETE" });
  }

  /** Removes one that has ended, with the results that the server keeps. */
  async forgetJob(id) {
    await this.request(`/v1/jobs/${id}?forget=true`, { method: "DELETE" });
  }

  /** {frames, first, count}: state and files of frames, in the order of the list. */
  jobFrames(id, { first = 0, count = 100 } = {}) {
    return this.json(`/v1/jobs/${id}/frames${queryOf({ first, count })}`);
  }

  // ---- trade-offs: time against error, measured ----

  /** Has a view measured with every technique; members as in docs/reference/tradeoffs.md. */
  async createTradeoff(request) {
    return (await this.send("POST", "/v1/tradeoffs", request)).json();
  }

  /** State, progress and results so far. */
  tradeoff(id) {
    return this.json(`/v1/tradeoffs/${encodeURIComponent(id)}`);
  }

  /** What is measured stays. */
  async cancelTradeoff(id) {
    await this.request(`/v1/tradeoffs/${encodeURIComponent(id)}`, { method: "DELETE" });
  }

  // ---- views ----

  async views() {
    return (await this.json("/v1/views")).views;
  }

  /**
   * Makes a view; its members are those of docs/reference/views.md.
   * @param {{expires_s?: number}} [options] forgotten when nobody asks for or watches it so long
   */
  async createView(members, { expires_s } = {}) {
    const response = await this.send("POST", `/v1/views${queryOf({ expires_s })}`, members);
    return new View(this, await response.json());
  }

  /** A view that exists already. */
  async view(id) {
    const { view, ...summary } = await this.json(`/v1/views/${encodeURIComponent(id)}`);
    return new View(this, summary);
  }
}

/** Mutable state over a scene, on the server. */
export class View {
  /** @param {Vitrail} client @param {object} summary as POST /v1/views answers it */
  constructor(client, summary) {
    this.client = client;
    this.id = summary.id;
    this.summary = summary;
    this.path = `/v1/views/${encodeURIComponent(summary.id)}`;
  }

  get revision() {
    return this.summary.revision;
  }

  /** Summary and, in `view`, all members. */
  get() {
    return this.client.json(this.path);
  }

  /**
   * A JSON merge patch (RFC 7396).
   * @param {object} members null takes a member back to its default
   * @param {{revision?: number}} [options] refuses (412, precondition_failed) when the view is at
   *   another one; the error says at which
   */
  async patch(members, { revision } = {}) {
    const response = await this.client.send("PATCH", this.path, members, {
      type: "application/merge-patch+json",
      headers: revision === undefined ? {} : { "If-Match": `"${revision}"` },
    });
    this.summary = await response.json();
    return this.summary;
  }

  /** Forgets it, also when the page is just being left. */
  async delete() {
    await this.client.request(this.path, { method: "DELETE", keepalive: true });
  }

  /** The exact image of the present revision. */
  async image({ aov, format, quality_percent, etag, signal } = {}) {
    const path = `${this.path}/image${queryOf({ aov, format, quality_percent })}`;
    const headers = etag ? { "If-None-Match": etag } : {};
    return imageOf(await this.client.request(path, { headers, signal }));
  }

  /** What is under a point of the image, in its pixels; null where nothing is. */
  async pick(x, y) {
    return (await this.client.json(`${this.path}/pick${queryOf({ x, y })}`)).hit;
  }

  /** Every layer under that point, nearest first, to the first opaque one. */
  async pickThrough(x, y) {
    return (await this.client.json(`${this.path}/pick${queryOf({ x, y, through: 1 })}`)).hits;
  }

  /** The nodes that show in a rectangle, as [{node, pixels}]. */
  async pickRectangle(x, y, width, height, { through } = {}) {
    const query = queryOf({ x, y, width, height, through: through ? 1 : undefined });
    return (await this.client.json(`${this.path}/pick${query}`)).nodes;
  }

  /** For the src of an <img>: moving pictures without any script. */
  get streamUrl() {
    return `${this.client.url}${this.path}/stream`;
  }

  /**
   * The same as an async iterator of {blob, revision, isExact, isRefined, scale, frame}, or of
   * {problem} for a frame that could not be rendered; leaving its loop, or the signal, ends it.
   */
  async *stream({ signal } = {}) {
    const response = await this.client.request(`${this.path}/stream`, { signal });
    for await (const { headers, content } of partsOf(response.body)) {
      const type = headers.get("content-type") ?? "";
      if (type.startsWith("application/problem+json")) {
        yield { problem: new VitrailError(JSON.parse(new TextDecoder().decode(content))) };
        continue;
      }
      yield {
        blob: new Blob([content], { type }),
        revision: Number(headers.get("x-view-revision")) || null,
        isExact: headers.get("x-view-exact") === "1",
        isRefined: headers.get("x-view-refined") === "1", // with stream.rest_samples
        scale: Number(headers.get("x-view-scale") ?? 1),
        frame: /\/v1\/frames\/([^>]+)>/.exec(headers.get("link") ?? "")?.[1] ?? null,
      };
    }
  }

  /** Server-sent events of the view: an EventSource with events view, progress, frame, problem, gone. */
  events() {
    return new EventSource(`${this.client.url}${this.path}/events`);
  }

  /** Moving pictures with edits up the same line. */
  socket() {
    return new ViewSocket(this);
  }
}

/**
 * The WebSocket of a view. Events: "open", "frame" (detail: {header, blob}; call ack() when done
 * with it), "changed", "patched", "progress", "problem" (detail: VitrailError), "close" (detail: {code, reason}).
 */
export class ViewSocket extends EventTarget {
  #socket;

  /** @param {View} view */
  constructor(view) {
    super();
    const page = typeof location === "undefined" ? undefined : location.href;
    const url = new URL(`${view.client.url}${view.path}/socket`, page);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    this.#socket = new WebSocket(url);
    this.#socket.binaryType = "arraybuffer";
    this.#socket.onmessage = (event) => this.#take(event.data);
    this.#socket.onclose = ({ code, reason }) => this.#tell("close", { code, reason });
  }

  get isOpen() {
    return this.#socket.readyState === 1;
  }

  #tell(type, detail) {
    const event = new Event(type);
    event.detail = detail;
    this.dispatchEvent(event);
  }

  #take(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      if (message.type === "hello") this.#tell("open", message);
      else if (message.type === "error") this.#tell("problem", new VitrailError(message));
      else this.#tell(message.type, message);
      return;
    }
    const length = new DataView(data).getUint32(0);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    const blob = new Blob([new Uint8Array(data, 4 + length)], { type: header.format });
    this.#tell("frame", { header, blob });
  }

  #send(message) {
    if (this.isOpen) this.#socket.send(JSON.stringify(message));
  }

  /** Replaces the camera; of several that come while a frame is made, the newest is shown. */
  camera(camera, seq) {
    this.#send({ type: "camera", camera, ...(seq === undefined ? {} : { seq }) });
  }

  /** A merge patch; answered by "patched", or by "problem". */
  patch(patch, id) {
    this.#send({ type: "patch", patch, ...(id === undefined ? {} : { id }) });
  }

  /** Sets members of `stream`. */
  quality(members) {
    this.#send({ type: "quality", ...members });
  }

  /** Done with frames: as many more may come. */
  ack(count = 1) {
    this.#send({ type: "ack", count });
  }

  close() {
    this.#socket.close(1000);
  }
}
