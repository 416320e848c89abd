// SPDX-License-Identifier: MIT
// Scenes come and go: by the list, by a link, as parts of others, and by other hands.
import { openAddPart } from "./add_part.js";
import { partSceneIds } from "./members.js";
import { clearProblems, notice, showProblem } from "./messages.js";

export class Opening {
  #gone = null; // {id, state} of a scene that somebody else removed while it showed

  /**
   * @param {Vitrail} client @param {Model} model @param {Address} address
   * @param {{aspect: () => number, close: () => void, scenes: () => object[], added: () => void,
   * gone: () => void}} tells close: nothing shows from now on
   */
  constructor(client, model, address, tells) {
    Object.assign(this, { client, model, address, tells });
    model.addEventListener("parts", () => this.#learn());
  }

  /** The scene and view that the address names; false when it names none, or what shows already. */
  async openLink() {
    const link = this.address.read();
    if (!link) return false;
    await this.open(link.scene, link.state);
    return true;
  }

  /** A scene, with the state of a link if there is one; without an id, none. */
  async open(id, state) {
    clearProblems();
    if (!id) {
      this.#close();
      return;
    }
    const known = state ?? (this.#gone?.id === id ? this.#gone.state : undefined);
    try {
      const [{ summary, outline }, parts] = await Promise.all([this.#described(id), this.#partsOf(known)]);
      this.model.aspect = this.tells.aspect();
      this.model.open(summary, outline, known, parts);
      this.#gone = null;
      this.#dropParts(this.model.unknownScenes);
    } catch (problem) {
      showProblem(problem, "The scene cannot be opened");
    }
  }

  #close() {
    this.tells.close();
    this.model.open(null);
    this.address.clear();
  }

  async #described(id) {
    const [summary, outline] = await Promise.all([this.client.scene(id), this.client.outline(id)]);
    return { summary, outline };
  }

  /** The scenes of the parts that a link names, by id, as far as the server has them. */
  async #partsOf(state) {
    return this.#describedOf(partSceneIds(state?.view?.parts ?? {}));
  }

  async #describedOf(ids) {
    const found = await Promise.all([...ids].map(async (id) => [id,
      await this.#described(id).catch((problem) => {
        if (problem.code !== "not_found") throw problem;
        return null;
      })]));
    return new Map(found.filter(([, described]) => described));
  }

  /** Takes out what is of scenes that the server does not have; false when nothing is. */
  #dropParts(ids) {
    const names = Object.entries(this.model.view.parts).filter(([, { scene }]) => ids.has(scene))
      .map(([name]) => name);
    if (!names.length) return false;
    this.model.removeParts(names);
    showProblem(new Error("Their scenes were removed from the server. Bring them again and undo."),
      `Without ${names.join(", ")}`);
    return true;
  }

  /** An undo brought parts back whose scenes were not here when the picture was opened. */
  async #learn() {
    const wanted = this.model.unknownScenes;
    if (!wanted.size) return;
    const found = await this.#describedOf(wanted).catch(() => new Map());
    if (found.size && this.model.scene) this.model.learnScenes(found);
  }

  /** No picture for want of a part's scene: goes on without it. False when all are there. */
  async partsGone() {
    const { scene } = this.model;
    const here = new Set((await this.client.scenes()).map(({ id }) => id));
    if (this.model.scene !== scene) return true; // another one shows by now
    const ids = [...partSceneIds(this.model.view.parts)];
    return this.#dropParts(new Set(ids.filter((id) => !here.has(id))));
  }

  /** Somebody removed the scene that shows. What was made of it is kept, should it come back. */
  sceneGone() {
    const { id, name } = this.model.scene;
    this.#gone = { id, state: this.model.toState() };
    showProblem(new Error("It was removed from the server. Bring its files again to go on where you were."),
      `${name ?? "The scene"} is gone`);
    this.#close();
    this.tells.gone();
  }

  /** Asks for another scene, and puts it into the one that shows. */
  addPart() {
    const selected = this.model.selectedNode;
    openAddPart(this.tells.scenes(), selected === null ? "" : this.model.nodeName(selected),
      async ({ id, name, isBelow }) => {
        try {
          const { summary, outline } = await this.#described(id);
          const added = this.model.addPart(name, summary, outline, isBelow ? selected : null);
          this.tells.added();
          notice(`${added} is added`);
        } catch (problem) {
          showProblem(problem, "The part was not added");
        }
      });
  }
}
