// Whether the calibration holds, after all touches on a specimen of known modulus.

import { $, put } from "./dom.js";

export class Verification {
  update(type, { verification }) {
    if (type !== "verification") return;
    $("verification").hidden = !verification.text;
    $("verification").classList.toggle("bad", !verification.agrees);
    put("verificationtext", verification.text);
    $("verify").hidden = verification.kept;
  }
}
