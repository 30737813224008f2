// What all parts of the window share: the sheet, the newest frame, the connection, a line for the person.
export const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
export const make = (tag, attributes, parent) => {
  const item = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) item.setAttribute(key, value);
  parent?.append(item);
  return item;
};
export const number = (v, digits = 3) => (Math.abs(v) < 1e-12 ? "0" : Math.abs(v) >= 1e-3 && Math.abs(v) < 1e5 ? Number(v.toPrecision(digits)).toString() : v.toExponential(2));
export const degrees = (rad) => `${(rad * 180 / Math.PI).toFixed(1)}°`;
// A text that is the same is not written: what is written is laid out and painted anew.
export const write = (item, text) => { if (item.textContent !== text) item.textContent = text; };

// The sheet that lies in the window, the numbers of its newest frame, and its positions, mm.
export const now = { sheet: null, head: null, points: null };

// ---------------------------------------------------------------- the connection

let socket = null;
let wait = 500; // ms until it is tried again
export function connect(answer, frame) {
  const query = new URLSearchParams(location.search);
  socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(query.get("token") ?? "")}`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { wait = 500; asked = 0; tell(""); again(); };
  socket.onmessage = ({ data }) => {
    if (typeof data !== "string") { frame(data); return; }
    const message = JSON.parse(data);
    answered(message); answer(message);
  };
  socket.onclose = () => {
    if (now.head) lost = now.head;
    $("badge").textContent = "not connected"; $("badge").classList.add("away-from");
    tell(now.head ? "The connection to bh is gone; what you see is the last state. It is tried again."
      : "bh does not answer, or eight windows are open, which is the most: close one. It is tried again.", true);
    setTimeout(() => connect(answer, frame), wait); wait = Math.min(2 * wait, 8000);
  };
}
// A server that comes back knows nothing of the sheet: it is laid again, and asked for what it was asked for last.
let lost = null, laid = [], laying = []; // the last frame before; messages that made the sheet, and those not answered yet
function again() {
  if (!lost) return;
  const { asked: folds, grips } = lost, sheet = [...laid, ...laying];
  lost = null; laid = []; laying = [];
  for (const message of sheet) ask(message);
  for (const [crease, angle] of Object.entries(folds)) ask({ do: "fold", crease, angle });
  for (const [node, to] of Object.entries(grips)) ask({ do: "pull", node: Number(node), to });
  tell("The connection to bh is back, and the sheet is folded again as it was asked for.");
}
const LAYS = ["open", "pattern", "material", "spring", "hold", "crease", "contact"];
// What was refused has made no sheet.
function answered({ kind, of, bad }) {
  if (!LAYS.includes(of) || !(kind === "sheet" || bad)) return;
  const message = laying.shift();
  if (!message || bad) return;
  if (of === "open" || of === "pattern") laid = laid.filter((each) => each.do === "material");
  laid.push(message);
}
// A stroke: from pointer to pointer, from key to key; what moves in it is taken back by one undo.
let stroke = 1;
for (const begins of ["pointerdown", "keydown", "change"]) addEventListener(begins, () => { stroke += 1; }, true);
export const MOVES = ["fold", "percent", "pull", "pinch"];
const after = []; // what is to be done once something was asked
export const whenAsked = (done) => after.push(done);
export let asked = 0; // messages of this connection; what was computed before the last of them is old
export function ask(message) {
  if (socket?.readyState !== WebSocket.OPEN) return;
  asked += 1;
  socket.send(JSON.stringify(MOVES.includes(message.do) ? { ...message, stroke } : message)); // at once: the rest can wait
  if (LAYS.includes(message.do)) laying.push(message);
  for (const done of after) done(message);
}

let quiet = 0;
export function tell(text, stays = false) {
  clearTimeout(quiet);
  $("message").textContent = text; $("message").hidden = !text;
  if (text && !stays) quiet = setTimeout(() => { $("message").hidden = true; }, 9000);
}

export function save(name, data) {
  download(name, new Blob([Uint8Array.from(atob(data), (c) => c.charCodeAt(0))]));
}
export function download(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob); link.download = name; link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
export const drawn = () => { if (socket?.readyState === WebSocket.OPEN) socket.send("drawn"); };
