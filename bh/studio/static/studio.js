// The window of bh studio: draws what the server sends, sends what a hand does. No physics is in here.
import * as THREE from "./vendor/three.module.min.js";
import { OrbitControls } from "./vendor/OrbitControls.js";

const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const make = (tag, attributes, parent) => {
  const item = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) item.setAttribute(key, value);
  parent?.append(item);
  return item;
};
const number = (v, digits = 3) => (v === 0 ? "0" : Math.abs(v) >= 1e-3 && Math.abs(v) < 1e5 ? Number(v.toPrecision(digits)).toString() : v.toExponential(2));
const degrees = (rad) => `${(rad * 180 / Math.PI).toFixed(1)}°`;

// ---------------------------------------------------------------- the connection

let socket = null;
let wait = 500; // ms until it is tried again
function connect() {
  const query = new URLSearchParams(location.search);
  socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(query.get("token") ?? "")}`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { wait = 500; tell(""); };
  socket.onmessage = ({ data }) => (typeof data === "string" ? answer(JSON.parse(data)) : frame(data));
  socket.onclose = () => {
    tell("The connection to bh is gone; what you see is the last state. It is tried again.", true);
    setTimeout(connect, wait); wait = Math.min(2 * wait, 8000);
  };
}
const ask = (message) => { if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message)); };

let quiet = 0;
function tell(text, stays = false) {
  clearTimeout(quiet);
  $("message").textContent = text; $("message").hidden = !text;
  if (text && !stays) quiet = setTimeout(() => { $("message").hidden = true; }, 9000);
}

function answer(message) {
  if (message.kind === "sheet") show(message);
  else if (message.kind === "file") save(message.name, message.data);
  else if (message.kind === "line") tell(message.text);
}

function save(name, data) {
  const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([bytes])); link.download = name; link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// ---------------------------------------------------------------- the folded sheet

const renderer = new THREE.WebGLRenderer({ canvas: $("folded"), antialias: true, alpha: true });
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(35, 1, 0.1, 1e6);
camera.up.set(0, 0, 1);
const controls = new OrbitControls(camera, renderer.domElement);
scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 2.2));
const lamp = new THREE.DirectionalLight(0xffffff, 1.4);
camera.add(lamp); scene.add(camera);
const geometry = new THREE.BufferGeometry();
const surface = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ vertexColors: true, side: THREE.DoubleSide, roughness: 0.85, flatShading: true }));
surface.frustumCulled = false;
const lines = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ vertexColors: true }));
lines.frustumCulled = false;
const handle = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]), new THREE.LineBasicMaterial({ color: 0xb06000 }));
handle.frustumCulled = false; handle.visible = false;
scene.add(surface, lines, handle);

let sheet = null, points = null, head = null, dirty = true, linePairs = null;
const history = { energy: [], force: [] };

function resize() {
  const box = $("stage");
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  renderer.setSize(box.clientWidth, box.clientHeight, false);
  camera.aspect = box.clientWidth / Math.max(box.clientHeight, 1);
  camera.updateProjectionMatrix(); dirty = true;
}
new ResizeObserver(resize).observe($("stage"));
controls.addEventListener("change", () => { dirty = true; });
function draw() {
  requestAnimationFrame(draw);
  if (!dirty) return;
  dirty = false; renderer.render(scene, camera); placeForce();
}

const STOPS = [[59, 15, 112], [140, 41, 129], [222, 73, 104], [254, 159, 109], [252, 253, 191]].map((c) => c.map((x) => (x / 255) ** 2.2));
function colour(part, out, at) {
  const x = Math.max(0, Math.min(0.9999, part)) * (STOPS.length - 1), k = Math.floor(x), f = x - k;
  for (let c = 0; c < 3; c++) out[at + c] = STOPS[k][c] * (1 - f) + STOPS[k + 1][c] * f;
}

function frame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  if (!sheet) { socket.send("drawn"); return; }
  const n = sheet.points.length / 3;
  const all = new Float32Array(buffer, 4 + length);
  points = all.subarray(0, 3 * n);
  const values = all.subarray(3 * n, 4 * n), position = geometry.getAttribute("position"), colours = geometry.getAttribute("color");
  position.array.set(points); position.needsUpdate = true;
  const plain = $("colour").value === "none" || !(head.top > 0);
  for (let i = 0; i < n; i++) {
    if (plain) colours.array.fill(0.82, 3 * i, 3 * i + 3);
    else colour(values[i] / head.top, colours.array, 3 * i);
  }
  colours.needsUpdate = true;
  const along = lines.geometry.getAttribute("position");
  for (let e = 0; e < linePairs.length; e++) along.array.set(points.subarray(3 * linePairs[e], 3 * linePairs[e] + 3), 3 * e);
  along.needsUpdate = true; geometry.computeBoundingSphere();
  numbers(); dirty = true;
  requestAnimationFrame(() => socket.readyState === WebSocket.OPEN && socket.send("drawn"));
  if (recording) remember();
}

function show(message) {
  sheet = message; head = null;
  const n = sheet.points.length / 3;
  points = new Float32Array(sheet.points);
  geometry.setAttribute("position", new THREE.BufferAttribute(points.slice(), 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(3 * n).fill(0.82), 3));
  geometry.setIndex(sheet.triangles);
  const rows = [], tint = [];
  const add = (pairs, rgb) => { for (const node of pairs) { rows.push(node); tint.push(...rgb); } };
  add(sheet.boundary, [0.15, 0.16, 0.18]);
  for (const crease of sheet.creases) add(crease.edges, { mountain: [0.55, 0.02, 0.02], valley: [0.02, 0.08, 0.5] }[crease.fold] ?? [0.4, 0.4, 0.4]);
  linePairs = rows;
  lines.geometry.dispose(); lines.geometry = new THREE.BufferGeometry();
  lines.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * rows.length), 3));
  lines.geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(tint), 3));
  geometry.computeBoundingSphere();
  const { center, radius } = geometry.boundingSphere;
  controls.target.copy(center);
  camera.position.set(center.x + 1.6 * radius, center.y - 2.6 * radius, center.z + 2.2 * radius);
  camera.near = radius / 100; camera.far = 100 * radius; camera.updateProjectionMatrix(); controls.update();
  history.energy = []; history.force = [];
  flat(); panel(); dirty = true;
}

// ---------------------------------------------------------------- the flat pattern

function flat() {
  const svg = $("flat"); svg.replaceChildren();
  const xs = sheet.points.filter((_, i) => i % 3 === 0), ys = sheet.points.filter((_, i) => i % 3 === 1).map((y) => -y);
  const low = [Math.min(...xs), Math.min(...ys)], size = [Math.max(...xs) - low[0], Math.max(...ys) - low[1]];
  const pad = 0.05 * Math.max(...size);
  svg.setAttribute("viewBox", [low[0] - pad, low[1] - pad, size[0] + 2 * pad, size[1] + 2 * pad].join(" "));
  const path = (pairs) => pairs.map((node, i) => `${i % 2 ? "L" : "M"}${xs[node]} ${ys[node]}`).join("");
  make("path", { d: path(sheet.boundary), class: "outline" }, svg);
  for (const crease of sheet.creases) {
    if (!crease.handled) { make("path", { d: path(crease.edges), class: "crease" }, make("g", { class: crease.fold }, svg)); continue; }
    const group = make("g", { class: crease.fold, tabindex: 0, role: "button", "aria-label": `${crease.fold} crease ${crease.name}` }, svg);
    make("title", {}, group).textContent = `${crease.name}, ${crease.fold}`;
    make("path", { d: path(crease.edges), class: "crease" }, group);
    make("path", { d: path(crease.edges), class: "hit" }, group);
    group.dataset.crease = crease.name;
    const pick = () => { $("each").open = true; slider(crease.name)?.focus(); };
    group.onclick = pick; group.onkeydown = (e) => { if (e.key === "Enter" || e.key === " ") { e.preventDefault(); pick(); } };
    group.onpointerenter = () => light(crease.name, true); group.onpointerleave = () => light(crease.name, false);
  }
  const rim = [...new Set(sheet.boundary)], step = Math.max(1, Math.ceil(rim.length / 60));
  const dots = new Set([...rim.filter((_, i) => i % step === 0), ...sheet.held]);
  for (const node of dots) {
    const held = sheet.held.includes(node);
    const dot = make("circle", { cx: xs[node], cy: ys[node], r: 0.008 * Math.max(...size), tabindex: 0, role: "checkbox", "aria-checked": held, "aria-label": `hold node ${node}` }, svg);
    dot.classList.toggle("held", held);
    const turn = () => ask({ do: "hold", node, on: !held });
    dot.onclick = turn; dot.onkeydown = (e) => { if (e.key === "Enter" || e.key === " ") { e.preventDefault(); turn(); } };
  }
}

const slider = (name) => [...$("sliders").querySelectorAll("input")].find((item) => item.dataset.crease === name);
function light(name, on) {
  for (const group of $("flat").querySelectorAll("g")) group.classList.toggle("lit", on && group.dataset.crease === name);
  let at = sheet.boundary.length;
  const tint = lines.geometry.getAttribute("color");
  for (const crease of sheet.creases) {
    const plain = { mountain: [0.55, 0.02, 0.02], valley: [0.02, 0.08, 0.5] }[crease.fold] ?? [0.4, 0.4, 0.4];
    for (let e = 0; e < crease.edges.length; e++, at++) tint.array.set(on && crease.name === name ? [1, 0.6, 0] : plain, 3 * at);
  }
  tint.needsUpdate = true; dirty = true;
}

// ---------------------------------------------------------------- controls and numbers

function options(select, names, chosen, first = "") {
  select.replaceChildren();
  if (first) select.append(new Option(first, ""));
  for (const [value, text] of names) select.append(new Option(text, value, false, value === chosen));
}

function panel() {
  options($("library"), sheet.library.map((n) => [n, n]), "", "choose");
  options($("export"), sheet.formats.map((n) => [n, n]), "", "choose");
  options($("material"), Object.entries(sheet.materials), sheet.material.name);
  $("E").value = sheet.material.E; $("t").value = sheet.material.t;
  $("remarks").replaceChildren(...sheet.remarks.map((text) => { const li = document.createElement("li"); li.textContent = text; return li; }));
  const box = $("sliders"); box.replaceChildren();
  for (const crease of sheet.creases.filter((c) => c.handled).slice(0, 200)) {
    const label = document.createElement("label"), input = document.createElement("input"), out = document.createElement("output");
    label.className = "wide"; label.append(`${crease.name} (${crease.fold})`, out);
    Object.assign(input, { type: "range", min: -179, max: 179, step: 0.5, value: 0 });
    input.setAttribute("aria-label", `fold angle of crease ${crease.name}, degrees`);
    input.dataset.crease = crease.name;
    input.oninput = () => ask({ do: "fold", crease: crease.name, angle: input.value * Math.PI / 180 });
    input.onfocus = () => light(crease.name, true); input.onblur = () => light(crease.name, false);
    box.append(label, input);
  }
  document.title = `${sheet.name}: bh studio`;
}

function numbers() {
  const rows = [["Energy", `${number(head.energy.total)} N mm`], ["of bending", `${number(head.energy.bending)} N mm`], ["of stretching", `${number(head.energy.stretching)} N mm`], ["of creases", `${number(head.energy.folding)} N mm`], ["Stable", head.stable === null ? "not known" : head.stable ? "yes" : "no"], ["Largest strain", `${number(100 * head.strain)} %`], ["Mesh", `${sheet.triangles.length / 3} triangles, ${sheet.formulation}`], ["Solved in", `${head.ms.toFixed(0)} ms`]];
  const names = Object.keys(head.folds);
  for (const name of names.slice(0, 8)) rows.push([`Fold of ${name}`, degrees(head.folds[name])]);
  $("numbers").replaceChildren(...rows.flatMap(([a, b]) => { const dt = document.createElement("dt"), dd = document.createElement("dd"); dt.textContent = a; dd.textContent = b; return [dt, dd]; }));
  for (const input of $("sliders").querySelectorAll("input")) {
    const angle = head.asked[input.dataset.crease] ?? 0;
    if (document.activeElement !== input) input.value = angle * 180 / Math.PI;
    input.previousElementSibling.querySelector("output").textContent = degrees(head.folds[input.dataset.crease] ?? 0);
  }
  const full = Object.fromEntries(sheet.creases.map((c) => [c.name, c.full]));
  const parts = names.map((name) => 100 * head.asked[name] / full[name]);
  if (parts.length && Math.max(...parts) - Math.min(...parts) < 0.01) {
    if (document.activeElement !== $("percent")) $("percent").value = parts[0];
    $("percent-out").textContent = `${parts[0].toFixed(1)} %`;
  } else $("percent-out").textContent = "each its own";
  const badge = $("badge");
  badge.textContent = head.note ? `cannot go on: ${head.note}` : head.snapped ? "snapped" : head.rest ? "in equilibrium" : "on its way";
  badge.classList.toggle("away-from", Boolean(head.note) || head.snapped || !head.rest);
  $("top").textContent = head.top > 0 ? `${number(head.top)}${$("colour").value === "strain" ? "" : " N mm / mm²"}` : "";
  $("let-go").disabled = Object.keys(head.grips).length === 0;
  if (head.rest) {
    history.energy.push([history.energy.length, head.energy.total]);
    for (const [node, force] of Object.entries(head.forces).slice(0, 1)) if (grabbed0[node]) {
      const d = Math.hypot(...[0, 1, 2].map((c) => points[3 * node + c] - grabbed0[node][c]));
      history.force.push([d, Math.hypot(...force)]);
    }
    curve($("energy-curve"), history.energy.slice(-400)); curve($("force-curve"), history.force.slice(-400));
  }
}

function curve(svg, data) {
  svg.replaceChildren(); if (data.length < 2) return;
  const xs = data.map((d) => d[0]), ys = data.map((d) => d[1]), x0 = Math.min(...xs), x1 = Math.max(...xs), y1 = Math.max(...ys, 1e-12);
  const w = svg.clientWidth || 280, h = svg.clientHeight || 84;
  const at = (d) => `${6 + (w - 12) * (d[0] - x0) / (x1 - x0 || 1)} ${h - 6 - (h - 22) * d[1] / y1}`;
  make("path", { d: "M" + data.map(at).join("L") }, svg);
  make("text", { x: 6, y: 13 }, svg).textContent = number(y1);
  make("text", { x: w - 6, y: h - 8, "text-anchor": "end" }, svg).textContent = number(x1);
}

// ---------------------------------------------------------------- pulling

const ray = new THREE.Raycaster(), plane = new THREE.Plane(), spot = new THREE.Vector3();
let grabbed = null;
const grabbed0 = {};
const pointer = (event) => {
  const box = renderer.domElement.getBoundingClientRect();
  return new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
};
renderer.domElement.addEventListener("pointerdown", (event) => {
  if (!sheet || event.button !== 0) return;
  ray.setFromCamera(pointer(event), camera);
  const hit = ray.intersectObject(surface)[0];
  if (!hit) return;
  controls.enabled = false;
  const corners = [hit.face.a, hit.face.b, hit.face.c];
  const apart = (node) => hit.point.distanceTo(new THREE.Vector3().fromArray(points, 3 * node));
  grabbed = corners.reduce((a, b) => (apart(a) <= apart(b) ? a : b));
  grabbed0[grabbed] ??= Array.from(points.subarray(3 * grabbed, 3 * grabbed + 3));
  history.force = [];
  plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(new THREE.Vector3()), new THREE.Vector3().fromArray(points, 3 * grabbed));
  renderer.domElement.setPointerCapture(event.pointerId);
}, true);
renderer.domElement.addEventListener("pointermove", (event) => {
  if (grabbed === null) return;
  ray.setFromCamera(pointer(event), camera);
  if (ray.ray.intersectPlane(plane, spot)) ask({ do: "pull", node: grabbed, to: spot.toArray() });
});
const drop = () => { grabbed = null; controls.enabled = true; };
renderer.domElement.addEventListener("pointerup", drop);
renderer.domElement.addEventListener("pointercancel", drop);

function placeForce() {
  const node = head && Object.keys(head.forces).at(-1);
  $("force").hidden = !node; handle.visible = Boolean(node);
  if (!node) return;
  const from = new THREE.Vector3().fromArray(points, 3 * node), to = new THREE.Vector3(...head.grips[node] ?? from.toArray());
  handle.geometry.setFromPoints([from, to]); handle.geometry.attributes.position.needsUpdate = true;
  const seen = to.clone().project(camera), box = $("stage");
  $("force").textContent = `${number(Math.hypot(...head.forces[node]))} N`;
  const w = $("force").offsetWidth;
  $("force").style.left = `${Math.max(0, Math.min(box.clientWidth - w - 4, (seen.x + 1) / 2 * box.clientWidth + 12))}px`;
  $("force").style.top = `${Math.max(0, Math.min(box.clientHeight - 28, (1 - seen.y) / 2 * box.clientHeight - 12))}px`;
}

// ---------------------------------------------------------------- what is clicked

$("percent").oninput = (e) => ask({ do: "percent", value: Number(e.target.value) });
$("undo").onclick = () => ask({ do: "undo" });
$("redo").onclick = () => ask({ do: "redo" });
$("flatten").onclick = () => ask({ do: "flatten" });
$("let-go").onclick = () => { for (const node of Object.keys(grabbed0)) delete grabbed0[node]; ask({ do: "let-go" }); };
$("check").onclick = () => { tell("It is solved anew from flat ..."); ask({ do: "check" }); };
$("library").onchange = (e) => { if (e.target.value) ask({ do: "pattern", name: e.target.value }); };
$("export").onchange = (e) => { if (e.target.value) ask({ do: "export", what: e.target.value }); e.target.value = ""; };
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

// ---------------------------------------------------------------- recording: what was asked, played again

let recording = null;
const remember = () => { const last = recording.at(-1); if (!last || JSON.stringify(last) !== JSON.stringify(head.asked)) recording.push(head.asked); };
$("play").onclick = () => {
  const button = $("play");
  if (button.textContent === "Record") { recording = []; button.textContent = "Play"; button.setAttribute("aria-pressed", "true"); return; }
  const frames = recording ?? []; recording = null; button.textContent = "Record"; button.setAttribute("aria-pressed", "false");
  frames.forEach((asked, k) => setTimeout(() => { for (const [crease, angle] of Object.entries(asked)) ask({ do: "fold", crease, angle }); }, 60 * k));
};

connect(); resize(); draw();
window.studio = { get points() { return points; }, get rest() { return head?.rest ?? false; }, get head() { return head; }, get sheet() { return sheet; },
  place: (node) => { const v = new THREE.Vector3().fromArray(points, 3 * node).project(camera), b = renderer.domElement.getBoundingClientRect(); return [b.left + (v.x + 1) / 2 * b.width, b.top + (1 - v.y) / 2 * b.height]; } };
