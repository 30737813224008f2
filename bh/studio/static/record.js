// Recording: what was asked is played again, and what is then seen can be saved as a film; pictures of the sheet.
import { $, ask, now, save, tell } from "./common.js";
import { picture, renderer, whenDrawn } from "./view.js";

const MOST = 100, WIDE = 640; // pictures of a film, and their width in pixels
let recording = null, kept = [], filming = null, wanted = null;
const wish = (head) => ({ asked: head.asked, grips: head.grips });

export function remember(head) {
  if (!recording) return;
  const last = recording.at(-1), next = wish(head);
  if (!last || JSON.stringify(last) !== JSON.stringify(next)) recording.push(next);
}
$("record").onclick = () => {
  if (recording) { kept = recording; recording = null; } else recording = now.head ? [wish(now.head)] : [];
  const on = recording !== null;
  $("record").textContent = on ? "Stop" : "Record"; $("record").setAttribute("aria-pressed", String(on));
  $("play").disabled = on || kept.length < 2;
  tell(on ? "What you do is recorded until you press Stop." : `${kept.length} positions are recorded; Play shows them, Save makes a film.gif of them.`);
};
$("play").onclick = () => play();

function arrives(asked, patience) {
  return new Promise((done) => {
    const began = performance.now();
    const there = () => now.head && JSON.stringify(now.head.asked) === JSON.stringify(asked) && (now.head.rest || now.head.note);
    const look = () => (there() || performance.now() - began > patience ? done() : setTimeout(look, 15));
    setTimeout(look, 30);
  });
}
export async function play() {
  $("play").disabled = true;
  let before = {};
  for (const { asked, grips } of kept) {
    for (const [crease, angle] of Object.entries(asked)) ask({ do: "fold", crease, angle });
    for (const node of Object.keys(before)) if (!(node in grips)) ask({ do: "let-go", node: Number(node) });
    for (const [node, to] of Object.entries(grips)) ask({ do: "pull", node: Number(node), to });
    before = grips;
    await arrives(asked, 3000);
  }
  $("play").disabled = false;
}

// The folded sheet on the colour of the paper, as a canvas of some width.
function copy(width) {
  const from = renderer.domElement, to = document.createElement("canvas");
  to.width = Math.min(width, from.width); to.height = Math.round(to.width * from.height / from.width);
  const brush = to.getContext("2d");
  brush.fillStyle = getComputedStyle(document.body).backgroundColor; brush.fillRect(0, 0, to.width, to.height);
  brush.drawImage(from, 0, 0, to.width, to.height);
  return to;
}
whenDrawn(() => {
  if (wanted) { const done = wanted; wanted = null; done(copy(4096)); }
  if (filming && filming.length < MOST) filming.push(copy(WIDE).toDataURL("image/jpeg", 0.85).split(",")[1]);
});
export async function savePicture() {
  const canvas = await new Promise((done) => { wanted = done; picture(); });
  save(`${now.sheet.name.replace(/\.\w+$/, "")}.png`, canvas.toDataURL("image/png").split(",")[1]);
}
export async function saveFilm(kind) {
  if (kept.length < 2) { tell("There is no recording yet: press Record, fold and pull, press Stop, then save the film."); return; }
  filming = [];
  await play();
  const pictures = filming; filming = null;
  if (pictures.length) ask({ do: "film", pictures, ms: 80, kind });
}
