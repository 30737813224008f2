// A hand on the folded sheet: a point is taken and pulled, its force stands beside the pointer; two are pinched.
import * as THREE from "./vendor/three.module.min.js";
import { $, ask, now, number, tell } from "./common.js";
import { camera, controls, renderer, scene, surface, vector, beforeDrawn } from "./view.js";
import * as pinch from "./pinch.js";
import { fingers } from "./touch.js";

const ray = new THREE.Raycaster(), plane = new THREE.Plane(), spot = new THREE.Vector3();
const string = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]), new THREE.LineBasicMaterial({ color: 0xb06000 }));
string.frustumCulled = false; string.visible = false; scene.add(string);
export const taken = {}; // where each node was when it was first taken, mm
let node = null, stroke = false;

function aim(event) {
  const box = renderer.domElement.getBoundingClientRect();
  ray.setFromCamera(new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height), camera);
}
// The node of the sheet that is nearest to the pointer; null beside the sheet.
function under(event) {
  aim(event);
  const hit = ray.intersectObject(surface)[0];
  if (!hit) return null;
  const apart = (corner) => hit.point.distanceTo(vector(now.points, corner));
  return [hit.face.a, hit.face.b, hit.face.c].reduce((a, b) => (apart(a) <= apart(b) ? a : b));
}
export const take = (which) => { taken[which] ??= Array.from(now.points.subarray(3 * which, 3 * which + 3)); };

// `hand` is told when a pointer is on the picture and when none is left; `took` is called when a point was taken.
export function pulls(hand, took) {
  const down = new Set();
  const up = (event) => { if (down.delete(event.pointerId) && !down.size) hand(false); };
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, up); // behind what the picture does with it
  renderer.domElement.addEventListener("pointerdown", (event) => {
    if (!now.sheet || event.button !== 0 || event.defaultPrevented) return;
    down.add(event.pointerId);
    hand(true);
    if (fingers(event)) { if (stroke) pinch.forget(); pinch.released(); node = null; stroke = false; return; } // a second finger: they move the view
    if (pinch.taken(event)) { hold(event); took(); return; }
    const found = under(event);
    if (found === null) return;
    hold(event);
    if (pinch.pinching()) { stroke = true; took(); pinch.choose(found); return; }
    node = found;
    take(node);
    took();
    plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(new THREE.Vector3()), vector(now.points, node));
  }, true);
}
function hold(event) { controls.enabled = false; renderer.domElement.setPointerCapture(event.pointerId); }
renderer.domElement.addEventListener("pointermove", (event) => {
  if (fingers(event)) return;
  aim(event);
  if (pinch.moved(ray.ray) || node === null) return;
  if (ray.ray.intersectPlane(plane, spot)) ask({ do: "pull", node, to: spot.toArray() });
});
const drop = (event) => {
  fingers(event);
  if (stroke && event.type === "pointerup") pinch.choose(under(event), true);
  if (pinch.released() || stroke || node !== null) controls.enabled = true;
  node = null; stroke = false;
};
renderer.domElement.addEventListener("pointerup", drop);
renderer.domElement.addEventListener("pointercancel", drop);

export function letGo() {
  for (const each of Object.keys(taken)) delete taken[each];
  for (const each of Object.keys(pinch.wide)) delete pinch.wide[each];
  pinch.forget();
  ask({ do: "let-go" });
}

// By numbers, for whom the pointer is no way: one node is lifted, two are pinched.
$("take").onclick = () => {
  const a = $("node-a").value, b = $("node-b").value;
  if (!now.sheet) return;
  const count = now.sheet.points.length / 3, isNode = (text) => /^[0-9]+$/.test(text) && Number(text) < count;
  if (!isNode(a) || (b !== "" && !isNode(b))) { tell(`Node '${isNode(a) ? b : a}' cannot be taken; give a whole number from 0 to ${count - 1}.`); return; }
  if (b !== "") { pinch.begin(Number(a), Number(b)); return; }
  $("lift").dataset.node = a; $("lift").disabled = false; $("lift").value = 0;
  const size = Math.max(...[0, 1].map((c) => Math.max(...now.sheet.points.filter((_, i) => i % 3 === c)) - Math.min(...now.sheet.points.filter((_, i) => i % 3 === c))));
  Object.assign($("lift"), { min: -size, max: size, step: size / 200 });
  delete taken[a]; take(a);
  $("lift").focus();
};
$("lift").oninput = ({ target }) => {
  const which = target.dataset.node, [x, y, z] = taken[which] ?? [0, 0, 0];
  $("lift-out").textContent = `${number(Number(target.value))} mm`;
  ask({ do: "pull", node: Number(which), to: [x, y, z + Number(target.value)] });
};

beforeDrawn(() => {
  const { head, points } = now, held = head && Object.keys(head.forces).at(-1);
  const squeezed = held && head.pinches.find((each) => [String(each.a), String(each.b)].includes(held));
  $("force").hidden = !held; string.visible = Boolean(held) && !squeezed;
  if (!held) return;
  const from = vector(points, held), to = new THREE.Vector3(...head.grips[held] ?? from.toArray());
  string.geometry.setFromPoints([from, to]); string.geometry.attributes.position.needsUpdate = true;
  const at = to.clone().project(camera), box = $("stage");
  $("force").textContent = squeezed ? pinch.said(squeezed) : `${number(Math.hypot(...head.forces[held]))} N`;
  const w = $("force").offsetWidth;
  $("force").style.left = `${Math.max(0, Math.min(box.clientWidth - w - 4, (at.x + 1) / 2 * box.clientWidth + 12))}px`;
  $("force").style.top = `${Math.max(0, Math.min(box.clientHeight - 28, (1 - at.y) / 2 * box.clientHeight - 12))}px`;
});
