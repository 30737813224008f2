// The folded sheet: triangles, lines and colours of whatever mesh is shown. No physics is in here.
import * as THREE from "./vendor/three.module.min.js";
import { OrbitControls } from "./vendor/OrbitControls.js";
import { $ } from "./common.js";
import { smoothed } from "./smooth.js";

const SOON = 250; // ms in which an answer is awaited, whose picture takes the place of another one
const CALM = 200; // ms without another picture, after which the edges of the last one are smoothed
export const renderer = new THREE.WebGLRenderer({ canvas: $("folded"), antialias: false, alpha: true });
export const scene = new THREE.Scene();
export const camera = new THREE.PerspectiveCamera(35, 1, 0.1, 1e6);
camera.up.set(0, 0, 1);
export const controls = new OrbitControls(camera, renderer.domElement);
scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 2.2));
camera.add(new THREE.DirectionalLight(0xffffff, 1.4)); scene.add(camera);
const geometry = new THREE.BufferGeometry();
export const surface = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ vertexColors: true, side: THREE.DoubleSide, roughness: 0.85, flatShading: true }));
surface.frustumCulled = false;
const lines = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ vertexColors: true }));
lines.frustumCulled = false;
scene.add(surface, lines);

let dirty = true, pairs = [], laid = null, lit = "", calm = 0, soon = 0;
const before = [], after = []; // what is to be done before a picture is drawn, and when it was
export const redraw = () => { dirty = true; };
export const redrawSoon = () => { dirty = false; clearTimeout(soon); soon = setTimeout(redraw, SOON); };
export const beforeDrawn = (done) => before.push(done);
export const whenDrawn = (done) => after.push(done);
export function draw() {
  requestAnimationFrame(draw);
  if (dirty) picture();
}
// Smooth edges take four times as long where there is no graphics card: only what stays has them.
export function picture(smooth = false) {
  dirty = false; camera.updateMatrixWorld();
  for (const done of before) done();
  if (smooth) smoothed(renderer, scene, camera); else renderer.render(scene, camera);
  for (const done of after) done();
  clearTimeout(calm); clearTimeout(soon);
  if (!smooth) calm = setTimeout(smoothen, CALM);
}
let awaited = () => false; // whether another picture is to come, which smooth edges would keep waiting
export const smoothUnless = (waits) => { awaited = waits; };
function smoothen() { if (awaited()) calm = setTimeout(smoothen, CALM); else picture(true); }

function resize() {
  const box = $("stage");
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  renderer.setSize(box.clientWidth, box.clientHeight, false);
  camera.aspect = box.clientWidth / Math.max(box.clientHeight, 1);
  camera.updateProjectionMatrix();
  picture(); // a canvas of another size is empty
}
new ResizeObserver(resize).observe($("stage"));
controls.addEventListener("change", redraw);

const STOPS = [[59, 15, 112], [140, 41, 129], [222, 73, 104], [254, 159, 109], [252, 253, 191]].map((c) => c.map((x) => (x / 255) ** 2.2));
function colour(part, out, at) {
  const x = Math.max(0, Math.min(0.9999, part)) * (STOPS.length - 1), k = Math.floor(x), f = x - k;
  for (let c = 0; c < 3; c++) out[at + c] = STOPS[k][c] * (1 - f) + STOPS[k + 1][c] * f;
}
const INK = { mountain: [0.55, 0.02, 0.02], valley: [0.02, 0.08, 0.5] };

// Another mesh: points, triangles, boundary and creases as the server describes them.
export function lay(mesh) {
  laid = mesh; geometry.dispose();
  const n = mesh.points.length / 3, tint = [];
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(mesh.points), 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(3 * n).fill(0.82), 3));
  geometry.setIndex(mesh.triangles);
  pairs = [...mesh.boundary, ...mesh.creases.flatMap((crease) => crease.edges)];
  for (const _ of mesh.boundary) tint.push(0.15, 0.16, 0.18);
  for (const crease of mesh.creases) for (const _ of crease.edges) tint.push(...INK[crease.fold] ?? [0.4, 0.4, 0.4]);
  lines.geometry.dispose(); lines.geometry = new THREE.BufferGeometry();
  lines.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * pairs.length), 3));
  lines.geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(tint), 3));
  if (lit) light(lit, true);
}

// Its positions, and its values on a scale that ends at `top`; without colours where that is not above 0.
export function move(points, values, top) {
  const position = geometry.getAttribute("position"), colours = geometry.getAttribute("color");
  position.array.set(points); position.needsUpdate = true;
  if (top > 0) for (let i = 0; i < values.length; i++) colour(values[i] / top, colours.array, 3 * i);
  else colours.array.fill(0.82);
  colours.needsUpdate = true;
  const along = lines.geometry.getAttribute("position");
  for (let e = 0; e < pairs.length; e++) along.array.set(points.subarray(3 * pairs[e], 3 * pairs[e] + 3), 3 * e);
  along.needsUpdate = true; geometry.computeBoundingSphere(); dirty = true;
}

export function fit() {
  geometry.computeBoundingSphere();
  const { center, radius } = geometry.boundingSphere;
  controls.target.copy(center);
  camera.position.set(center.x + 1.6 * radius, center.y - 2.6 * radius, center.z + 2.2 * radius);
  camera.near = radius / 100; camera.far = 100 * radius; camera.updateProjectionMatrix(); controls.update(); dirty = true;
}

export function light(name, on) {
  lit = on ? name : "";
  for (const group of $("flat").querySelectorAll("g")) group.classList.toggle("lit", on && group.dataset.crease === name);
  let at = laid.boundary.length;
  const tint = lines.geometry.getAttribute("color");
  for (const crease of laid.creases) {
    const ink = on && crease.name === name ? [1, 0.6, 0] : INK[crease.fold] ?? [0.4, 0.4, 0.4];
    for (const _ of crease.edges) tint.array.set(ink, 3 * at++);
  }
  tint.needsUpdate = true; dirty = true;
}

export const vector = (points, node) => new THREE.Vector3().fromArray(points, 3 * node);
// Where a point of space is seen, in pixels of the page.
export function seen(at) {
  const v = at.clone().project(camera), box = renderer.domElement.getBoundingClientRect();
  return [box.left + (v.x + 1) / 2 * box.width, box.top + (1 - v.y) / 2 * box.height];
}

renderer.domElement.addEventListener("keydown", (e) => {
  const turn = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[e.key];
  if (!turn) return;
  e.preventDefault();
  const offset = camera.position.clone().sub(controls.target), ball = new THREE.Spherical();
  offset.applyAxisAngle(new THREE.Vector3(1, 0, 0), -Math.PI / 2); ball.setFromVector3(offset);
  ball.theta += turn[0]; ball.phi = Math.max(0.05, Math.min(Math.PI - 0.05, ball.phi + turn[1]));
  offset.setFromSpherical(ball).applyAxisAngle(new THREE.Vector3(1, 0, 0), Math.PI / 2);
  camera.position.copy(controls.target).add(offset); controls.update(); dirty = true;
});
