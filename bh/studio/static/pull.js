// A hand on the folded sheet: a point is taken and pulled, its force stands beside the pointer.
import * as THREE from "./vendor/three.module.min.js";
import { $, ask, now, number } from "./common.js";
import { camera, controls, renderer, scene, surface, vector, whenDrawn } from "./view.js";

const ray = new THREE.Raycaster(), plane = new THREE.Plane(), spot = new THREE.Vector3();
const string = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]), new THREE.LineBasicMaterial({ color: 0xb06000 }));
string.frustumCulled = false; string.visible = false; scene.add(string);
export const taken = {}; // where each node was when it was first taken, mm
let node = null;

export function pointer(event) {
  const box = renderer.domElement.getBoundingClientRect();
  return new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
}

// `begin` is called before the sheet is looked for under the pointer, `took` when a point was taken.
export function pulls(begin, took) {
  renderer.domElement.addEventListener("pointerdown", (event) => {
    if (!now.sheet || event.button !== 0 || event.defaultPrevented) return;
    begin();
    ray.setFromCamera(pointer(event), camera);
    const hit = ray.intersectObject(surface)[0];
    if (!hit) return;
    controls.enabled = false;
    const apart = (corner) => hit.point.distanceTo(vector(now.points, corner));
    node = [hit.face.a, hit.face.b, hit.face.c].reduce((a, b) => (apart(a) <= apart(b) ? a : b));
    taken[node] ??= Array.from(now.points.subarray(3 * node, 3 * node + 3));
    took();
    plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(new THREE.Vector3()), vector(now.points, node));
    renderer.domElement.setPointerCapture(event.pointerId);
  }, true);
}
renderer.domElement.addEventListener("pointermove", (event) => {
  if (node === null) return;
  ray.setFromCamera(pointer(event), camera);
  if (ray.ray.intersectPlane(plane, spot)) ask({ do: "pull", node, to: spot.toArray() });
});
const drop = () => { if (node !== null) { node = null; controls.enabled = true; } };
renderer.domElement.addEventListener("pointerup", drop);
renderer.domElement.addEventListener("pointercancel", drop);

export function letGo() {
  for (const each of Object.keys(taken)) delete taken[each];
  ask({ do: "let-go" });
}

whenDrawn(() => {
  const { head, points } = now, held = head && Object.keys(head.forces).at(-1);
  $("force").hidden = !held; string.visible = Boolean(held);
  if (!held) return;
  const from = vector(points, held), to = new THREE.Vector3(...head.grips[held] ?? from.toArray());
  string.geometry.setFromPoints([from, to]); string.geometry.attributes.position.needsUpdate = true;
  const at = to.clone().project(camera), box = $("stage");
  $("force").textContent = `${number(Math.hypot(...head.forces[held]))} N`;
  const w = $("force").offsetWidth;
  $("force").style.left = `${Math.max(0, Math.min(box.clientWidth - w - 4, (at.x + 1) / 2 * box.clientWidth + 12))}px`;
  $("force").style.top = `${Math.max(0, Math.min(box.clientHeight - 28, (1 - at.y) / 2 * box.clientHeight - 12))}px`;
});
