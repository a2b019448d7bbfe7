// A measurement whose rows come bit by bit: they are shown at once, its words some times a second.

const TELL_MS = 200;
const NEWS = ["events", "touches", "session"];

export class Flow {
  // got: the measurement; to: rows(block), tell(kind, message)
  constructor(got, to) {
    Object.assign(this, { got, to, later: null });
  }

  take(block) {
    if (block.end) this.to.rows(block);
    this.later ??= setTimeout(() => this.tell(), TELL_MS);
  }

  // What is new; `more` is what the page knows beside it.
  tell(more = {}) {
    const { got, to } = this, state = got.state;
    this.stop();
    if (got.news) for (const kind of NEWS) to.tell(kind, got[kind]);
    to.tell("state", { ...state, ...more, messages: [...state.messages, ...(more.messages ?? [])] });
  }

  stop() {
    clearTimeout(this.later);
    this.later = null;
  }
}
