// SPDX-License-Identifier: MIT
// Long lists: rows of one height, of which only those in sight are in the page, and one that may be
// taller. A row stays the same element as long as it is in sight, so that nothing loses the focus.

const SPARE = 8; // rows above and below those in sight
const UNSEEN_PX = 600; // height that is filled while the panel is not shown

export class Rows {
  #drawn = new Map(); // elements by row
  #tall = -1; // the row that may be taller
  #tallPx = 0; // by so much
  px = 25; // height of the others

  /**
   * @param {HTMLElement} panel scrolls @param {HTMLElement} list holds the rows
   * @param {object} of
   * @param {() => number} of.count of rows
   * @param {(at: number) => HTMLElement} of.row makes one, or answers the one that it made before
   * @param {() => number[]} [of.kept] rows that are in the page also out of sight
   * @param {() => number} [of.tall] the row that may be taller than others; below 0: none
   * @param {() => number} [of.headPx] height at the top of the panel that covers rows
   */
  constructor(panel, list, { count, row, kept = () => [], tall = () => -1, headPx = () => 0 }) {
    Object.assign(this, { panel, list, count, row, kept, tall, headPx });
    this.size = new ResizeObserver(() => this.#measure());
    panel.addEventListener("scroll", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(panel);
  }

  /** Height of a row as the style sheet has it. */
  #readPx() {
    return Number.parseFloat(getComputedStyle(this.list).getPropertyValue("--row")) || 25;
  }

  #topOf(at) {
    return at * this.px + (this.#tall >= 0 && at > this.#tall ? this.#tallPx : 0);
  }

  /** The row at a height of the list. */
  #rowAt(top) {
    const tallTop = (this.#tall + 1) * this.px;
    if (this.#tall < 0 || top <= tallTop) return Math.floor(top / this.px);
    return Math.max(this.#tall, Math.floor((top - this.#tallPx) / this.px));
  }

  /** Rows as they should be now; fresh: all are asked for anew. */
  draw(isFresh = false) {
    this.px = this.#readPx();
    const count = this.count();
    const tall = this.tall();
    if (tall !== this.#tall) this.#tallPx = 0;
    this.#tall = tall < count ? tall : -1;
    const top = Math.max(0, this.panel.scrollTop - this.list.offsetTop);
    const first = Math.max(0, this.#rowAt(top) - SPARE);
    const last = Math.min(count,
      this.#rowAt(top + (this.panel.clientHeight || UNSEEN_PX)) + SPARE + 1);
    const kept = [...this.kept(), this.#tall].filter((at) => at >= 0 && at < count);
    const wanted = new Set(Array.from({ length: Math.max(0, last - first) }, (_, i) => first + i));
    for (const at of kept) wanted.add(at);
    const drawn = new Map([...wanted].sort((a, b) => a - b).map((at) =>
      [at, (isFresh ? null : this.#drawn.get(at)) ?? this.row(at)]));
    this.#put(drawn);
    this.#place();
  }

  /** What stays in its place among the others is not touched. */
  #put(drawn) {
    const key = document.activeElement?.dataset?.key;
    const hasFocus = this.list.contains(document.activeElement);
    const elements = [...drawn.values()];
    const stays = new Set(elements);
    for (const child of [...this.list.children]) if (!stays.has(child)) child.remove();
    let next = this.list.firstElementChild;
    for (const element of elements) {
      if (element === next) next = next.nextElementSibling;
      else this.list.insertBefore(element, next);
    }
    this.#drawn = drawn;
    if (hasFocus && key && document.activeElement?.dataset?.key !== key)
      this.list.querySelector(`[data-key="${CSS.escape(key)}"]`)?.focus({ preventScroll: true });
    this.size.disconnect();
    const tall = drawn.get(this.#tall);
    if (tall) this.size.observe(tall);
  }

  #place() {
    for (const [at, element] of this.#drawn) element.style.top = `${this.#topOf(at)}px`;
    this.list.style.height = `${this.#topOf(this.count())}px`;
    this.#measure();
  }

  #measure() {
    const height = this.#drawn.get(this.#tall)?.offsetHeight ?? 0;
    const more = height > 0 ? Math.max(0, height - this.px) : this.#tallPx;
    if (more === this.#tallPx) return;
    this.#tallPx = more;
    this.#place();
  }

  /** All of a row in sight, as far as there is room. */
  scrollTo(at) {
    const top = this.list.offsetTop + this.#topOf(at);
    const height = this.px + (at === this.#tall ? this.#tallPx : 0);
    const head = this.headPx();
    const { scrollTop, clientHeight } = this.panel;
    if (top + height > scrollTop + clientHeight) this.panel.scrollTop = top + height - clientHeight;
    if (top < this.panel.scrollTop + head) this.panel.scrollTop = top - head;
    this.draw();
  }

  /** The row to which a key goes from another one; null when it is none of these keys. */
  rowOfKey(key, at) {
    const page = Math.max(1, Math.floor(this.panel.clientHeight / this.px) - 2);
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, PageDown: at + page, PageUp: at - page, Home: 0,
      End: Infinity }[key];
    return to === undefined ? null : Math.min(Math.max(to, 0), this.count() - 1);
  }
}
