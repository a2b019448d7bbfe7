// The web socket: connects again after a failure, or when nothing comes any more.

const WAITS_MS = [250, 500, 1000, 2000];
const SILENT_S = 5; // the server sends its state five times a second
const OUTDATED = 403; // status of an address with the token of an earlier start

const LOST = {
  title: "No connection: trying again.",
  text: "This page has lost palpate: look at its terminal; what is shown is the last that is known.",
};
const OLD = {
  title: "Address no longer valid.",
  text: "palpate live has started again: open the address that it printed in its terminal.",
};

/**
 * @typedef {object} Receiver What gets the messages.
 * @property {(message: import("./messages").Message) => void} text
 * @property {(frame: ArrayBuffer) => void} frame
 * @property {() => void} up The connection is open.
 * @property {(title: string, text: string) => void} down It is not.
 */

export class Connection {
  /** @param {Receiver} on */
  constructor(on) {
    this.on = on;
    this.failures = 0;
    this.open();
    setInterval(() => this.check(), 1000);
  }

  open() {
    const socket = new WebSocket("ws"); // beside the page, which may have its token in the path
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.failures = 0;
      this.on.up();
    };
    socket.onmessage = ({ data }) => {
      this.silent_s = 0;
      if (typeof data === "string") {
        this.on.text(JSON.parse(data));
      } else {
        this.on.frame(data);
      }
    };
    socket.onclose = ({ reason }) => this.reconnect(reason);
    this.socket = socket;
    this.silent_s = 0;
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  // Counts seconds in which the page ran: after a sleep it first reads what has come.
  check() {
    if (!this.isOpen) return;
    this.silent_s += 1;
    if (this.silent_s <= SILENT_S) return;
    this.socket.onclose = null;
    this.socket.onmessage = null;
    this.socket.close();
    this.reconnect("");
  }

  // A web socket does not say why it was refused; a request does.
  async reconnect(reason) {
    const wait = WAITS_MS[Math.min(this.failures, WAITS_MS.length - 1)];
    setTimeout(() => this.open(), wait);
    if (reason) {
      this.on.down(`${reason.charAt(0).toUpperCase()}${reason.slice(1)}.`, LOST.text);
      return;
    }
    if (this.failures === 0) this.on.down(LOST.title, LOST.text);
    this.failures += 1;
    const why = await cause();
    if (!this.isOpen) this.on.down(why.title, why.text);
  }

  /**
   * @param {import("./messages").Command} command
   * @returns {boolean} Whether it was sent.
   */
  send(command) {
    if (!this.isOpen) return false;
    this.socket.send(JSON.stringify(command));
    return true;
  }
}

// Why the server cannot be reached: a request is answered if only the token is an old one.
async function cause() {
  try {
    const { status } = await fetch("icon.svg", { cache: "no-store" });
    return status === OUTDATED ? OLD : LOST;
  } catch {
    return LOST;
  }
}
