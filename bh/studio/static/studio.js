// The window of bh studio: draws what the server sends, sends what a hand does. No physics is in here.
import { $, ask, asked, connect, drawn, now, save, tell } from "./common.js";
import { draw, fit, lay, move, picture, seen, smoothUnless, vector } from "./view.js";
import { letGo, pulls } from "./pull.js";
import { flat } from "./flat.js";
import { badge, branch, finer, hand, refined, seenAgain, seenCoarse } from "./finer.js";
import { asItIs, history, numbers, oneCrease, panel, slider } from "./panel.js";
import { remember, saveFilm, saveMoving, savePicture } from "./record.js";

// ---------------------------------------------------------------- what the server sends

function answer(message) {
  if (message.kind === "sheet") { show(message); if ($("message").textContent.endsWith("...")) tell(""); }
  else if (message.kind === "file") { save(message.name, message.data); tell(`${message.name} is saved.`); }
  else if (message.kind === "line") { tell(message.text); if (message.bad && now.sheet) asItIs(); }
  else if (message.kind === "branch") branch(message);
}

function show(sheet) {
  const same = now.sheet?.name === sheet.name && now.sheet.points.length === sheet.points.length && now.sheet.points.every((x, i) => x === sheet.points[i]);
  Object.assign(now, { sheet, head: null, points: new Float32Array(sheet.points) });
  seenCoarse(null); lay(sheet);
  if (!same) fit(); // who turned it looks on from there
  flat(choose); panel();
}

function choose(name) { $("each").open = true; oneCrease(name); (slider(name) ?? $("kind")).focus(); }

function frame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const floats = new Float32Array(buffer, 4 + length);
  if (head.kind === "finer") { finer(head, floats); return; }
  now.head = head;
  if (!now.sheet) { drawn(); return; }
  const n = now.sheet.points.length / 3;
  if (floats.length) { // else the sheet lies as it did, and only the numbers tell more
    const values = floats.subarray(3 * n, 4 * n);
    now.points = floats.subarray(0, 3 * n);
    seenCoarse(values);
    move(now.points, values, head.top);
    picture(); // not when the browser draws next: where that is slow, it is so because of the picture before
    if (drawing) drawing = 2; else { drawing = 1; drawn(); requestAnimationFrame(rested); }
  } else { seenAgain(); drawn(); }
  badge(); said();
  remember(head);
}

// Another frame may come before the browser has shown one, not more of them: they would only wait for each other.
let drawing = 0;
function rested() {
  if (drawing === 2) { drawing = 1; drawn(); requestAnimationFrame(rested); } else drawing = 0;
}

smoothUnless(() => now.head && (now.head.heard !== asked || !(now.head.arrived || now.head.note)));

// Numbers and curves at the side: behind the picture, on the way now and then only, as each of them is painted anew.
const OFTEN = 250; // ms
let later = 0, written = 0;
function said() {
  if (now.head.rest || now.head.note) { clearTimeout(later); later = 0; numbers(); }
  else later ||= setTimeout(() => { later = 0; written = performance.now(); if (now.head) numbers(); }, Math.max(0, written + OFTEN - performance.now()));
}

// ---------------------------------------------------------------- what is clicked

pulls(hand, () => { history.force = []; });
$("percent").oninput = (e) => ask({ do: "percent", value: Number(e.target.value) });
$("undo").onclick = () => ask({ do: "undo" });
$("redo").onclick = () => ask({ do: "redo" });
$("flatten").onclick = () => ask({ do: "flatten" });
$("let-go").onclick = letGo;
$("check").onclick = () => { tell("It is solved anew from flat ..."); ask({ do: "check" }); };
$("library").onchange = (e) => { if (e.target.value) ask({ do: "pattern", name: e.target.value }); };
const OWN = { picture: savePicture, film: () => saveFilm("gif"), mp4: saveMoving };
$("export").onchange = (e) => { const what = e.target.value; e.target.value = ""; if (OWN[what]) OWN[what](); else if (what) { tell("It is written ..."); ask({ do: "export", what }); } };
$("spring").onclick = () => ask({ do: "spring", crease: $("spring-of").value, Lstar: Number($("Lstar").value) || null });
$("contact").onchange = (e) => { tell(e.target.checked ? "It is folded anew from flat, with panels that stop each other ..." : "Panels pass through each other from now on."); ask({ do: "contact", on: e.target.checked }); };
$("material").onchange = (e) => ask({ do: "material", name: e.target.value });
$("E").onchange = (e) => ask({ do: "material", E: Number(e.target.value) });
$("t").onchange = (e) => ask({ do: "material", t: Number(e.target.value) });
$("colour").onchange = (e) => ask({ do: "colour", by: e.target.value });
$("file").onchange = (e) => { if (e.target.files[0]) open(e.target.files[0]); e.target.value = ""; };
addEventListener("keydown", (e) => {
  if (!(e.ctrlKey || e.metaKey)) return;
  if (e.key === "z" && !e.shiftKey) { e.preventDefault(); ask({ do: "undo" }); }
  if (e.key === "y" || (e.key === "z" && e.shiftKey)) { e.preventDefault(); ask({ do: "redo" }); }
});
addEventListener("dragover", (e) => e.preventDefault());
addEventListener("drop", (e) => { e.preventDefault(); if (e.dataTransfer.files[0]) open(e.dataTransfer.files[0]); });
async function open(file) {
  if (file.size > 5e6) { tell(`'${file.name}' is longer than 5 MB; fold it by bh fold`); return; }
  tell(`'${file.name}' is read ...`);
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = "";
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  ask({ do: "open", name: file.name, data: btoa(text) });
}

connect(answer, frame); draw();
window.studio = { get points() { return now.points; }, get rest() { return Boolean(now.head?.rest) && now.head.heard === asked; }, get head() { return now.head; }, get sheet() { return now.sheet; }, get refined() { return refined(); },
  place: (node) => seen(vector(now.points, node)), spot: (at) => seen(vector(at, 0)) };
