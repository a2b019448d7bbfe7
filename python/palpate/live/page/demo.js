// The demo: a simulated probe, pressed here with a mouse, a finger or a key. The server has the force and the readings.

import { $, fill, make, put } from "./dom.js";
import { inUnit, modulusOf, plusMinus, settings } from "./formatting.js";
import { showsModulus } from "./reading.js";

const HOLDING_KEYS = [" ", "Enter"];
const DONE = "Lift"; // the word of a touch that is complete
const LEFT_OUT = "Repeat";

export class Demo {
  constructor(known, send) {
    this.known = known;
    this.send = send;
    this.pressed = null;
    $("democalibrate").onclick = () => $("calibrate").click();
    addEventListener("pointerup", () => this.release());
    addEventListener("pointercancel", () => this.release());
    addEventListener("blur", () => this.release());
  }

  update(type, known) {
    const specimens = known.hello.simulation?.specimens ?? [];
    $("demo").hidden = specimens.length === 0;
    document.body.classList.toggle("pressable", specimens.length > 0);
    if (specimens.length === 0 || !known.session.specimens) return;
    fill($("blocks"), specimens, () => specimens.map((specimen, place) => this.block(specimen, place)));
    put("demowords", instruction(known));
    const { calibration, hello } = known;
    $("democalibrate").hidden = Boolean(calibration.on) || hello.calibrated;
    for (const { name, modulus } of specimens) this.showBlock(name, modulus);
    const complete = known.state.now?.word === DONE;
    $("demo").classList.toggle("complete", complete);
  }

  block({ name }, place) {
    const button = make("button", { type: "button", id: `block-${name}` });
    button.style.setProperty("--give", `${14 - 3 * place}px`);
    button.append(make("b", { textContent: name }), make("span"), make("span"));
    button.onpointerdown = (event) => this.hold(event, name);
    button.oncontextmenu = (event) => event.preventDefault();
    button.onkeydown = (event) => {
      if (!HOLDING_KEYS.includes(event.key)) return;
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) this.press(name);
    };
    button.onkeyup = (event) => {
      if (HOLDING_KEYS.includes(event.key)) this.release();
    };
    // not of another block, on which a pointer presses now
    button.onblur = () => {
      if (this.pressed === name) this.release();
    };
    return button;
  }

  hold(event, name) {
    if (event.button !== 0) return;
    event.target.releasePointerCapture?.(event.pointerId); // a finger that slides off still lifts
    this.press(name);
  }

  press(name) {
    if (this.pressed === name) return;
    this.pressed = name;
    this.goOn();
    this.send({ do: "press", specimen: name });
    this.showPressed();
  }

  // A press after the end of the calibration is the first one that it measures.
  goOn() {
    const { calibration, session } = this.known;
    if (calibration.on && calibration.saved) this.send({ do: "calibrating", on: false });
    if (session.done) this.send({ do: "specimen", name: "" });
  }

  release() {
    if (this.pressed === null) return;
    this.pressed = null;
    this.send({ do: "release" });
    this.showPressed();
  }

  showPressed() {
    for (const button of $("blocks").children) {
      button.classList.toggle("pressed", button.id === `block-${this.pressed}`);
    }
  }

  showBlock(name, modulus) {
    const { session, calibration } = this.known;
    const button = $(`block-${name}`);
    const wanted = calibration.on && session.next?.name === name;
    button.classList.toggle("wanted", Boolean(wanted));
    const [, measured, truth] = button.children;
    const touch = this.known.touches.rows.findLast((row) => row.specimen === name && row.kept !== false);
    put(measured, touch ? measuredWords(this.known, touch) : "untouched");
    const words = touch ? `true ${inUnit(modulus)}` : "";
    fill(truth, [words, settings.unit], () => (words ? [words, make("i", { textContent: ` ${settings.unit}` })] : []));
  }
}

// What to do with the blocks.
function instruction({ session, calibration, hello, state }) {
  if (state.now?.word === DONE) return "Let go: the touch is complete.";
  if (state.now?.word === LEFT_OUT) return "This touch does not count: press again, and hold until the ring is full.";
  if (calibration.on && session.next) {
    return `Press and hold ${session.next.name}: touch ${session.next.nth} of ${session.next.of}.`;
  }
  if (hello.calibrated) return "Press and hold any of them: its modulus comes from your calibration.";
  return "Your mouse is the hand: press and hold one of these, with the mouse, a finger, or Tab and the space bar.";
}

// What a touch has measured: the modulus with a calibration, else the ratio.
function measuredWords(known, touch) {
  if (showsModulus(known) && touch.modulus) {
    const { value, unit, interval } = modulusOf(touch.modulus);
    return unit ? `${value} ${unit}` : interval;
  }
  const [ratio] = plusMinus(touch.ratio, touch.uncertainty);
  return `ratio ${ratio}`;
}
