// The state at rest on a finer mesh: shown until a hand asks for something else.
import { $, asked, now, number, whenAsked } from "./common.js";
import { lay, move } from "./view.js";
import { scale } from "./panel.js";

let shown = false, said = "", coarse = null;
let flat = null; // where a run from flat ends, of the state that is shown
let held = false, last = null; // a hand is on the sheet; the newest finer frame, which it has put off

// A frame of the coarse mesh: what is seen from now on.
export function seenCoarse(values) {
  if (shown) lay(now.sheet);
  coarse = values; shown = false; said = ""; last = null; flat = null;
}

// Back to the coarse mesh at once: a point is taken, or a slider moved.
export function back() {
  if (!shown) return;
  lay(now.sheet); move(now.points, coarse, now.head.top); scale(now.head.top);
  shown = false; said = ""; badge();
}
whenAsked(back);

// A hand is on the folded sheet, or off it: what it points at must not become another mesh meanwhile.
export function hand(on) {
  held = on;
  if (on) back(); else if (last) finer(...last);
}

export function finer(head, floats) {
  last = now.head?.rest && head.heard === asked ? [head, floats] : null;
  if (!last || held) return;
  const error = head.error === null ? "" : `, energy within about ${number(100 * head.error, 2)} %`;
  said = head.mesh ? `refined: ${head.mesh.triangles.length / 3} triangles${error}` : "in equilibrium, on this mesh";
  now.error = head.error === null ? `not known: ${head.reason}` : `${number(100 * head.error, 2)} %${head.reason ? `; ${head.reason}` : ""}`;
  if (head.mesh) {
    const n = head.mesh.points.length / 3;
    lay(head.mesh); move(floats.subarray(0, 3 * n), floats.subarray(3 * n, 4 * n), head.top); scale(head.top);
    shown = true;
  }
  badge();
  if (!now.sheet.contact) $("meets").textContent = head.meets ? `pass through each other at ${head.meets} places` : "do not meet";
  $("error").textContent = now.error; $("error").title = now.error;
}

export function branch(message) {
  if (!now.head?.rest) return;
  flat = message; badge();
  $("flat-run").textContent = message.said;
}

export function badge() {
  const { head } = now, place = $("badge");
  place.textContent = said || (head.note ? `cannot go on: ${head.note}` : head.snapped ? "snapped" : head.rest ? "in equilibrium" : "on its way");
  if (flat && !flat.here) place.textContent += ", on another branch than a run from flat";
  else if (head.left && head.rest && !head.snapped) place.textContent += ", behind a snap";
  place.classList.toggle("away-from", !said && (Boolean(head.note) || head.snapped || !head.rest));
}
export const refined = () => shown;
