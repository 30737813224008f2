// Recording: what was asked is played again, and what is then seen can be saved as a film; pictures of the sheet.
import { $, ask, download, now, save, tell } from "./common.js";
import { picture, renderer, whenDrawn } from "./view.js";

const EMPTY = "There is no recording yet: press Record, fold and pull, press Stop, then save the film.";
const MOST = 100, WIDE = 640; // pictures of a film, and their width in pixels
let recording = null, kept = [], filming = null, wanted = null, streaming = null;
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
  to.width = 2 * Math.round(Math.min(width, from.width) / 2); to.height = 2 * Math.round(to.width * from.height / from.width / 2); // even, as films want
  paper(to.getContext("2d"), to);
  return to;
}
function paper(brush, { width, height }) {
  brush.fillStyle = getComputedStyle(document.body).backgroundColor; brush.fillRect(0, 0, width, height);
  brush.drawImage(renderer.domElement, 0, 0, width, height);
}
whenDrawn(() => {
  streaming?.();
  if (wanted) { const done = wanted; wanted = null; done(copy(4096)); }
  if (filming && filming.length < MOST) filming.push(copy(WIDE).toDataURL("image/jpeg", 0.85).split(",")[1]);
});
export async function savePicture() {
  const canvas = await new Promise((done) => { wanted = done; picture(true); });
  save(`${now.sheet.name.replace(/\.\w+$/, "")}.png`, canvas.toDataURL("image/png").split(",")[1]);
}
// Where the browser writes films itself: what it can write, the first that goes.
const KINDS = [["video/mp4;codecs=avc1.42E01E", "mp4"], ["video/mp4;codecs=avc1.640028", "mp4"], ["video/webm;codecs=vp9", "webm"], ["video/webm", "webm"]];
export const written = KINDS.find(([type]) => globalThis.MediaRecorder?.isTypeSupported(type)) ?? null;

// What is seen while the recording is played, as a film that the browser writes; null where it cannot.
async function moving() {
  const canvas = copy(1280), brush = canvas.getContext("2d"), pieces = [];
  const film = new MediaRecorder(canvas.captureStream(30), { mimeType: written[0], videoBitsPerSecond: 4e6 });
  const done = new Promise((ends) => { film.onstop = ends; film.onerror = ends; });
  film.ondataavailable = ({ data }) => { if (data.size) pieces.push(data); };
  streaming = () => { paper(brush, canvas); };
  film.start(); await play(); streaming = null;
  await new Promise((later) => setTimeout(later, 200)); // the last picture is seen for a moment
  film.stop(); await done;
  return pieces.length ? new Blob(pieces, { type: written[0] }) : null;
}
export async function saveMoving() {
  if (kept.length < 2) { tell(EMPTY); return; }
  const film = written && await moving();
  if (film) { download(`${now.sheet.name.replace(/\.\w+$/, "")}.${written[1]}`, film); tell(`The film is saved as ${written[1]} (${written[0].split("=")[1] ?? "as the browser writes it"}).`); }
  else saveFilm("mp4");
}
export async function saveFilm(kind) {
  if (kept.length < 2) { tell(EMPTY); return; }
  filming = [];
  await play();
  const pictures = filming; filming = null;
  if (pictures.length) ask({ do: "film", pictures, ms: 80, kind });
}
