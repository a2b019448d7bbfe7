// Pointer, wheel and touch on a chart of time, as gestures: drag, select, click, hover, zoom at the pointer, pinch.

const STILL = 4; // pixels that a click may move
const WHEEL = 0.0022; // zoom for each pixel of the wheel

// on: { grab(x, event) -> what the drag does: (x, dx) => {} or null, select(from x, to x), selecting(x, x) or (null),
//       click(x, y, event), hover(x or null, y), zoom(factor, x), slide(pixels) }, each in pixels of the chart.
export function gestures(place, on) {
  const held = new Map(); // pointers that are down -> x
  let start = null;
  const at = (event) => {
    const box = place.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const pinch = () => {
    const [a, b] = [...held.values()];
    return { middle: (a + b) / 2, apart: Math.max(20, Math.abs(a - b)) };
  };

  place.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    const [x] = at(event);
    place.setPointerCapture(event.pointerId);
    held.set(event.pointerId, x);
    start = held.size > 1 ? null : { x, last: x, moved: false, drag: event.shiftKey ? null : on.grab(x, event) };
  });
  place.addEventListener("pointermove", (event) => {
    const [x, y] = at(event);
    if (!held.has(event.pointerId)) return on.hover(x, y);
    const before = held.size === 2 ? pinch() : null;
    held.set(event.pointerId, x);
    if (before) {
      const { middle, apart } = pinch();
      on.zoom(before.apart / apart, middle);
      on.slide(before.middle - middle);
    } else if (start) moved(x);
  });
  const moved = (x) => {
    start.moved ||= Math.abs(x - start.x) > STILL;
    if (!start.moved) return;
    if (start.drag) start.drag(x, x - start.last);
    else on.selecting(start.x, x);
    start.last = x;
    on.hover(null);
  };
  const released = (event) => {
    const known = held.delete(event.pointerId), [x, y] = at(event), last = start;
    if (held.size) return;
    start = null;
    if (!known || !last) return;
    if (!last.drag && last.moved) on.selecting(null);
    if (event.type !== "pointerup") return;
    if (!last.moved) on.click(x, y, event);
    else if (!last.drag) on.select(Math.min(last.x, x), Math.max(last.x, x));
  };
  place.addEventListener("pointerup", released);
  place.addEventListener("pointercancel", released);
  place.addEventListener("pointerleave", () => on.hover(null));
  place.addEventListener("wheel", (event) => {
    event.preventDefault();
    const scale = event.deltaMode ? 16 : 1, [x] = at(event);
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) on.slide(event.deltaX * scale);
    else on.zoom(Math.exp(Math.max(-240, Math.min(240, event.deltaY * scale)) * WHEEL), x);
  }, { passive: false });
}
