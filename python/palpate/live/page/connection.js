// The web socket: connects again after a failure, or when nothing comes any more.

const WAITS_MS = [250, 500, 1000, 2000];
const SILENT_S = 5; // the server sends its state five times a second
const LOST = ["No connection: trying again.", "This page has lost palpate: look at its terminal; what is shown is the last that is known."];
const OLD = ["Address no longer valid.", "palpate live has started again: open the address that it printed in its terminal."];

export class Connection {
  // on: { text(message), frame(buffer), up(), down(title, text) }
  constructor(on) {
    this.on = on;
    this.failures = 0;
    this.open();
    setInterval(() => this.listen(), 1000);
  }

  open() {
    const socket = new WebSocket("ws"); // beside the page, which may have its token in the path
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.failures = 0;
      this.on.up();
    };
    socket.onmessage = ({ data }) => {
      this.silent = 0;
      if (typeof data === "string") this.on.text(JSON.parse(data));
      else this.on.frame(data);
    };
    socket.onclose = ({ reason }) => this.again(reason);
    this.socket = socket;
    this.silent = 0;
  }

  // Counts seconds in which the page ran: after a sleep it first reads what has come.
  listen() {
    if (this.socket.readyState !== WebSocket.OPEN || ++this.silent <= SILENT_S) return;
    this.socket.onclose = this.socket.onmessage = null;
    this.socket.close();
    this.again("");
  }

  // A web socket does not tell why it was refused; a request does.
  async again(reason) {
    setTimeout(() => this.open(), WAITS_MS[Math.min(this.failures, WAITS_MS.length - 1)]);
    if (reason || !this.failures++) this.on.down(reason ? `${reason.charAt(0).toUpperCase()}${reason.slice(1)}.` : LOST[0], LOST[1]);
    const told = await fetch("icon.svg", { cache: "no-store" }).then(({ status }) => (status === 403 ? OLD : LOST), () => LOST);
    if (!reason && this.socket.readyState !== WebSocket.OPEN) this.on.down(...told);
  }

  say(message) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }
}
