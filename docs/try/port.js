// A serial port of this computer, by the Web Serial API (wicg.github.io/serial).

import { Refused } from "./core.js";

export const RATES = [9600, 19200, 38400, 57600, 115200, 230400, 250000, 460800, 500000, 921600, 1000000, 2000000];
const ROOM = 65536; // bytes that wait while the page is busy

// Why this browser cannot, in words; "": it can.
export function unsupported() {
  if (navigator.serial) return "";
  if (!isSecureContext) return "A browser gives serial ports to a page from https or from a file only. Save this page, and open the file.";
  return "This browser has no access to serial ports. Chrome, Edge, Opera and a new Firefox on a computer have; so has palpate live.";
}

export class Port {
  asked = false; // whether it was closed by the user
  name = "serial port";

  // Lets the user choose a port, and opens it.
  async open(baudRate) {
    this.port = await navigator.serial.requestPort();
    const { usbVendorId: vendor, usbProductId: product } = this.port.getInfo?.() ?? {}, hex = (id) => id.toString(16).padStart(4, "0");
    if (vendor !== undefined) this.name = `serial port, USB ${hex(vendor)}:${hex(product)}`;
    try {
      await this.port.open({ baudRate, bufferSize: ROOM });
    } catch (error) {
      throw new Refused(`${this.name}: it cannot be opened (${error.message}) Is another program reading it? On Linux, are you in the group dialout?`);
    }
  }

  // Its bytes until it is closed or gone: { chunk }, or { lost: why } after an error from which the port recovers.
  async *chunks() {
    while (this.port.readable && !this.asked) {
      this.reader = this.port.readable.getReader();
      try {
        for (;;) {
          const { value, done } = await this.reader.read();
          if (done) return;
          yield { chunk: value };
        }
      } catch (error) {
        if (!this.port.readable) return; // it is gone
        yield { lost: error.name };
      } finally {
        this.reader.releaseLock();
      }
    }
  }

  // Ends `chunks`.
  stop() {
    this.asked = true;
    this.reader?.cancel().catch(() => {}); // it may be gone
  }

  // After the end of `chunks`: while they are read, a port cannot be closed.
  async close() {
    await this.port?.close().catch(() => {}); // it may be gone
  }
}
