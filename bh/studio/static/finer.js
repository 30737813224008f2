// The state at rest on a finer mesh: shown until a hand asks for something else.
import { $, MOVES, asked, now, number, whenAsked, write } from "./common.js";
import { lay, move, redrawSoon } from "./view.js";
import { scale } from "./panel.js";

let shown = false, said = "", coarse = null;
let flat = null; // where a run from flat ends, of the state that is shown
let held = false, last = null; // a hand is on the sheet; the newest finer frame, which it has put off

// A frame of the coarse mesh: what is seen from now on.
export function seenCoarse(values) {
  if (shown) lay(now.sheet);
  coarse = values; shown = false; said = ""; last = null; flat = null;
}

// It lies as it did, and what was found of it beside the frames is found anew.
export function seenAgain() { back(); said = ""; last = null; flat = null; }

// Back to the coarse mesh at once: a point is taken, or a slider moved. Where an answer comes soon it is seen instead.
export function back(answered = false) {
  if (!shown) return;
  lay(now.sheet); move(now.points, coarse, now.head.top); scale(now.head.top);
  if (answered) redrawSoon();
  shown = false; said = ""; badge();
}
whenAsked((message) => { const moves = MOVES.includes(message.do); back(moves); if (moves) { said = ""; flat = null; badge(); } });

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
  if (!now.head?.rest || now.head.heard !== asked) return;
  flat = message; badge();
  $("flat-run").textContent = message.said;
}

export function badge() {
  const { head } = now, place = $("badge");
  if (!head) return;
  const rest = head.rest && head.heard === asked; // what was asked since is on its way
  const text = said || (head.note ? `cannot go on: ${head.note}` : head.snapped ? "snapped" : rest ? "in equilibrium" : "on its way");
  const elsewhere = flat && !flat.here ? ", on another branch than a run from flat" : head.left && rest && !head.snapped ? ", behind a snap" : "";
  write(place, text + elsewhere);
  place.classList.toggle("away-from", !said && (Boolean(head.note) || head.snapped || !rest));
}
export const refined = () => shown;
