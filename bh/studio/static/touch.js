// Two fingers on the folded sheet: they zoom by their distance and shift by their middle, wherever they lie.
import * as THREE from "./vendor/three.module.min.js";
import { camera, controls, renderer } from "./view.js";

const touching = new Map(); // where each finger is, pixels of the page
let before = null; // [distance, x, y] of two fingers

function span() {
  const [[x, y], [u, v]] = touching.values();
  return [Math.max(Math.hypot(u - x, v - y), 1), (x + u) / 2, (y + v) / 2];
}
// Keep count of a finger; whether two of them have the view in hand.
export function fingers(event) {
  if (event.pointerType !== "touch") return false;
  const { type, pointerId: id } = event;
  if (type === "pointerup" || type === "pointercancel") {
    touching.delete(id);
    if (before && !touching.size) { before = null; controls.enabled = true; }
    return before !== null;
  }
  if (type === "pointerdown") {
    touching.set(id, [event.clientX, event.clientY]);
    if (touching.size !== 2) return before !== null;
    controls.enabled = false; before = span();
    renderer.domElement.setPointerCapture(id);
  } else if (touching.has(id)) touching.set(id, [event.clientX, event.clientY]);
  if (before && touching.size === 2) move();
  return before !== null;
}
function move() {
  const now = span(), offset = camera.position.clone().sub(controls.target).multiplyScalar(before[0] / now[0]);
  const pixel = 2 * offset.length() * Math.tan(camera.fov * Math.PI / 360) / renderer.domElement.clientHeight; // mm
  const [right, up] = [0, 1].map((k) => new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, k));
  controls.target.addScaledVector(right, -pixel * (now[1] - before[1])).addScaledVector(up, pixel * (now[2] - before[2]));
  camera.position.copy(controls.target).add(offset);
  controls.update(); before = now;
}
