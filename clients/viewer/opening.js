// SPDX-License-Identifier: MIT
// Scenes come and go: by the list, by a link, as parts of others, and by other hands.
import { openAddPart } from "./add_part.js";
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

  /** The scenes of the parts that a link names, by id. */
  async #partsOf(state) {
    const ids = new Set(Object.values(state?.view?.parts ?? {}).map(({ scene }) => scene));
    return new Map(await Promise.all([...ids].map(async (id) => [id, await this.#described(id)])));
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
