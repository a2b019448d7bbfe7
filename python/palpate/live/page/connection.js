// The web socket: connects again after a failure. The page confirms each frame, so that a slow page gets fewer.

const WAITS_MS = [250, 500, 1000, 2000];

export class Connection {
  // on: { text(message), frame(buffer), up(), down() }
  constructor(on) {
    this.on = on;
    this.failures = 0;
    this.open();
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/ws`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.failures = 0;
      this.on.up();
    };
    socket.onmessage = ({ data }) => (typeof data === "string" ? this.on.text(JSON.parse(data)) : this.on.frame(data));
    socket.onclose = ({ reason }) => {
      this.on.down(reason);
      const wait = WAITS_MS[Math.min(this.failures++, WAITS_MS.length - 1)];
      setTimeout(() => this.open(), wait);
    };
    this.socket = socket;
  }

  say(message) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }
}
