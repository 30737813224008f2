// Jaws on two points of the folded sheet: chosen by two clicks or a stroke, closed by dragging either of them.
import * as THREE from "./vendor/three.module.min.js";
import { $, ask, now, number, tell } from "./common.js";
import { camera, redraw, renderer, scene, seen, vector, beforeDrawn } from "./view.js";

const NEAR = 16, FINGER = 28; // pixels in which a jaw is taken, by a pointer and by a finger
const ink = new THREE.MeshBasicMaterial({ color: 0xb06000, depthTest: false, transparent: true, opacity: 0.9 });
const ball = () => { const item = new THREE.Mesh(new THREE.SphereGeometry(1, 16, 12), ink); item.renderOrder = 2; item.visible = false; item.frustumCulled = false; scene.add(item); return item; };
const jaws = [ball(), ball()];
const rod = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]), new THREE.LineBasicMaterial({ color: 0xb06000, depthTest: false, transparent: true }));
rod.frustumCulled = false; rod.visible = false; scene.add(rod);
let first = null, dragged = null; // the point that waits for another one; the jaw in hand
export const wide = {}; // how far apart the nodes of a pinch were when it began, mm

export const pinching = () => $("hand-pinch").checked;
export const key = (a, b) => `${a} ${b}`;
const at = (pinch, side) => new THREE.Vector3(...pinch.middle).addScaledVector(new THREE.Vector3(...pinch.along), 0.5 * side * pinch.gap);

export function begin(a, b) {
  wide[key(a, b)] = vector(now.points, a).distanceTo(vector(now.points, b));
  ask({ do: "pinch", a, b });
  tell(`Points ${a} and ${b} are between jaws: drag a jaw, or move the slider "Gap".`);
}

// A point was pressed on, or a stroke ended at it.
export function choose(node, ended = false) {
  if (first === null && !ended) { first = node; tell("Now the other point: click it, or draw to it."); }
  else if (first !== null && node !== null && node !== first) { begin(first, node); first = null; }
  redraw();
}
export function forget() { first = null; redraw(); }

// Whether a jaw lies under the pointer; it is dragged then.
export function taken(event) {
  for (const pinch of now.head?.pinches ?? []) for (const side of [-1, 1]) {
    const [x, y] = seen(at(pinch, side));
    if (Math.hypot(x - event.clientX, y - event.clientY) < (event.pointerType === "touch" ? FINGER : NEAR)) { dragged = { pinch, side }; return true; }
  }
  return false;
}

// Whether a jaw is in hand; it goes to where the ray of the pointer comes nearest to its line.
export function moved(ray) {
  if (!dragged) return false;
  const { pinch, side } = dragged, middle = new THREE.Vector3(...pinch.middle), along = new THREE.Vector3(...pinch.along);
  const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(camera.getWorldDirection(new THREE.Vector3()), middle), spot = new THREE.Vector3();
  if (!ray.intersectPlane(plane, spot)) return true;
  const flat = along.clone().projectOnPlane(plane.normal), size = flat.lengthSq();
  if (size > 0.01) ask({ do: "pinch", a: pinch.a, b: pinch.b, gap: Math.max(0, 2 * side * spot.sub(middle).dot(flat) / size) });
  return true;
}
export function released() { const held = dragged; dragged = null; return Boolean(held); }

export const said = (pinch) => `${pinch.force < -1e-9 ? "pulled apart by" : "pinch"} ${number(Math.abs(pinch.force))} N, ${number(pinch.apart)} mm apart`;

// The slider of the gap, for whom the pointer is no way.
export function panel(head) {
  const pinch = head.pinches.at(-1), box = $("pinch-box");
  box.hidden = !pinch;
  if (!pinch) return;
  const slider = $("gap"), most = 1.5 * (wide[key(pinch.a, pinch.b)] ?? pinch.apart);
  slider.max = most; slider.step = most / 300; slider.dataset.a = pinch.a; slider.dataset.b = pinch.b;
  if (document.activeElement !== slider) slider.value = pinch.gap;
  $("gap-out").textContent = `${number(pinch.gap)} mm`;
  const [one, two] = [pinch.a, pinch.b].map((node) => Math.hypot(...head.forces[node] ?? [0]));
  const uneven = Math.abs(one - two) > Math.max(0.05 * Math.max(one, two), 1e-9);
  $("pinch-said").textContent = said(pinch) + (uneven ? `; the jaws have ${number(one)} and ${number(two)} N, held points carry the rest` : "");
}
$("gap").oninput = ({ target }) => ask({ do: "pinch", a: Number(target.dataset.a), b: Number(target.dataset.b), gap: Number(target.value) });
for (const id of ["hand-pull", "hand-pinch"]) $(id).onchange = forget;
addEventListener("keydown", (event) => { if (event.key === "Escape") forget(); });

beforeDrawn(() => {
  const pinch = now.head?.pinches?.at(-1), ends = first !== null ? [vector(now.points, first)] : pinch ? [at(pinch, -1), at(pinch, 1)] : [];
  jaws.forEach((jaw, side) => {
    jaw.visible = side < ends.length;
    if (jaw.visible) { jaw.position.copy(ends[side]); jaw.scale.setScalar(0.012 * camera.position.distanceTo(ends[side])); }
  });
  rod.visible = ends.length === 2;
  if (rod.visible) { rod.geometry.setFromPoints(ends); rod.geometry.attributes.position.needsUpdate = true; }
});
