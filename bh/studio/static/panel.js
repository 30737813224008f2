// Controls, numbers and curves at the side.
import { $, ask, degrees, make, now, number, tell, write } from "./common.js";
import { light } from "./view.js";
import { key, panel as pinchPanel, wide } from "./pinch.js";
import { taken } from "./pull.js";
import { written } from "./record.js";

const MOST = 200; // sliders of single creases
export const history = { energy: [], force: [] };

function options(select, names, chosen, first = "") {
  select.replaceChildren();
  if (first) select.append(new Option(first, ""));
  for (const [value, text] of names) select.append(new Option(text, value, false, value === chosen));
}

const SAID = { scene: "scene, for bh run", python: "lines of Python", result: "numbers, JSON", picture: "picture, PNG", film: "film of the recording, GIF", mp4: `film of the recording, ${(written?.[1] ?? "mp4").toUpperCase().replace("WEBM", "WebM")}` };
function saves(formats) {
  const select = $("export"), groups = { "What was done": [], "Folded sheet": [], "Flat pattern, to cut": [] };
  for (const name of [...formats, "picture", "film", "mp4"]) groups[name.startsWith("flat.") ? "Flat pattern, to cut" : name.startsWith("folded.") || name in { picture: 1, film: 1, mp4: 1 } ? "Folded sheet" : "What was done"].push(name);
  select.replaceChildren(new Option("choose", ""));
  for (const [label, names] of Object.entries(groups)) {
    const group = document.createElement("optgroup"); group.label = label;
    group.append(...names.map((name) => new Option(SAID[name] ?? name.split(".")[1].toUpperCase(), name))); select.append(group);
  }
}

// Numbers of a pattern of the library; lists as numbers between blanks.
function values(sheet) {
  const box = $("values"), entries = Object.entries(sheet.values);
  box.hidden = !entries.length;
  box.replaceChildren(box.firstElementChild, ...entries.map(([key, value]) => {
    const label = document.createElement("label"), input = document.createElement("input");
    input.value = [value].flat().join(" "); input.dataset.key = key; label.append(`${key[0].toUpperCase()}${key.slice(1)} `, input);
    input.onchange = () => {
      const given = Object.fromEntries([...box.querySelectorAll("input")].map((item) => {
        const numbers = item.value.trim().split(/[\s,;]+/).map(Number);
        return [item.dataset.key, Array.isArray(sheet.values[item.dataset.key]) ? numbers : numbers[0]];
      }));
      if (Object.values(given).flat().every(Number.isFinite)) ask({ do: "pattern", name: sheet.name, values: given });
      else tell("A number of the pattern cannot be read; give numbers, such as 60 75 90.");
    };
    return label;
  }));
}

// What is said of the crease that is chosen.
export function oneCrease(name = $("spring-of").value) {
  $("spring-of").value = name;
  const crease = now.sheet.creases.find((c) => c.name === name && c.turns), laws = now.sheet.springs;
  $("kind").disabled = !crease; $("kind").value = crease?.fold ?? "";
  $("Lstar").value = (crease ? laws[name] : Object.values(laws)[0]) ?? "";
}
$("spring-of").onchange = () => oneCrease();
$("kind").onchange = ({ target }) => ask({ do: "crease", crease: $("spring-of").value, kind: target.value });

// The numbers that the sheet has, in place of those that were refused.
export function asItIs() {
  const { sheet } = now;
  $("material").value = sheet.material.name; $("E").value = sheet.material.E; $("t").value = sheet.material.t; $("contact").checked = sheet.contact; oneCrease();
  for (const input of $("values").querySelectorAll("input")) input.value = [sheet.values[input.dataset.key]].flat().join(" ");
}

export function panel() {
  const { sheet } = now;
  options($("library"), sheet.library.map((n) => [n, n]), "", "choose");
  saves(sheet.formats); values(sheet);
  const turning = sheet.creases.filter((c) => c.turns), before = $("spring-of").value;
  options($("spring-of"), [["all", "all"], ...turning.map((c) => [c.name, c.name])], turning.some((c) => c.name === before) ? before : "all");
  oneCrease(); $("contact").checked = sheet.contact;
  options($("material"), Object.entries(sheet.materials), sheet.material.name);
  options($("colour"), [...Object.entries(sheet.colours).map(([name, [label]]) => [name, label]), ["none", "none"]], sheet.colour);
  $("E").value = sheet.material.E; $("t").value = sheet.material.t;
  $("remarks").replaceChildren(...sheet.remarks.map((text) => { const li = document.createElement("li"); li.textContent = text; return li; }));
  const box = $("sliders"); box.replaceChildren();
  for (const crease of sheet.creases.filter((c) => c.handled).slice(0, MOST)) {
    const label = document.createElement("label"), input = document.createElement("input"), out = document.createElement("output");
    label.className = "wide"; label.append(`${crease.name} (${crease.fold})`, out);
    Object.assign(input, { type: "range", min: -179, max: 179, step: 0.5, value: 0 });
    input.setAttribute("aria-label", `fold angle of crease ${crease.name}, degrees`);
    input.dataset.crease = crease.name;
    input.oninput = () => ask({ do: "fold", crease: crease.name, angle: input.value * Math.PI / 180 });
    input.onfocus = () => light(crease.name, true); input.onblur = () => light(crease.name, false);
    box.append(label, input);
  }
  history.energy = []; history.force = [];
  document.title = `${sheet.name}: bh studio`;
}

export const slider = (name) => [...$("sliders").querySelectorAll("input")].find((item) => item.dataset.crease === name);

export function scale(top) {
  const [label, unit] = now.sheet.colours[$("colour").value] ?? ["", ""];
  $("scale").hidden = !(top > 0) || !unit;
  write($("middle"), number(0.5 * top)); write($("top"), number(top)); write($("unit"), `${label}, ${unit}`);
  $("scale").setAttribute("aria-label", `Colours: ${label}, from 0 to ${number(top)} ${unit}`);
}

export function numbers() {
  const { head, sheet } = now, { energy } = head;
  const rows = [["Energy", `${number(energy.total, 4)} N mm`], ["of bending", `${number(energy.bending, 4)} N mm`], ["of stretching", `${number(energy.stretching, 4)} N mm`], ["of creases", `${number(energy.folding, 4)} N mm`], ["Stable", head.stable === null ? "not known" : head.stable ? "yes" : "no"], ["Largest strain", `${number(100 * head.strain)} %`], ["Mesh", `${sheet.triangles.length / 3} triangles, ${sheet.formulation}`], ["Error of the energy", "not looked at", "error"], ["Panels", sheet.contact ? "stop each other" : "not looked at", "meets"], ["A run from flat", "not looked at", "flat-run"], ["Solved in", `${head.ms.toFixed(0)} ms`]];
  const names = Object.keys(head.folds);
  for (const name of names.slice(0, 8)) rows.push([`Fold of ${name}`, degrees(head.folds[name])]);
  table(rows);
  for (const input of $("sliders").querySelectorAll("input")) {
    const angle = head.asked[input.dataset.crease] ?? 0;
    if (document.activeElement !== input) input.value = angle * 180 / Math.PI;
    write(input.previousElementSibling.querySelector("output"), degrees(head.folds[input.dataset.crease] ?? 0));
  }
  const full = Object.fromEntries(sheet.creases.map((c) => [c.name, c.full]));
  const parts = names.map((name) => 100 * head.asked[name] / full[name]);
  if (parts.length && Math.max(...parts) - Math.min(...parts) < 0.01) {
    if (document.activeElement !== $("percent")) $("percent").value = parts[0];
    write($("percent-out"), `${parts[0].toFixed(1)} %`);
  } else write($("percent-out"), "each its own");
  scale(head.top);
  $("let-go").disabled = Object.keys(head.grips).length === 0;
  pinchPanel(head);
  if (head.rest) curves();
}

// Names, values and, of some, the id; what stands there is kept where the names are the same.
function table(rows) {
  const list = $("numbers");
  if (list.children.length !== 2 * rows.length) list.replaceChildren(...rows.flatMap(() => [document.createElement("dt"), document.createElement("dd")]));
  rows.forEach(([name, value, id = ""], row) => {
    const [dt, dd] = [list.children[2 * row], list.children[2 * row + 1]];
    write(dt, name); write(dd, value);
    if (dd.id !== id) dd.id = id;
    if (id === "error") dd.removeAttribute("title");
  });
}

function curves() {
  const { head, points } = now;
  history.energy.push([history.energy.length, head.energy.total]);
  const pinch = head.pinches.at(-1);
  if (pinch) history.force.push([Math.max(0, (wide[key(pinch.a, pinch.b)] ?? pinch.apart) - pinch.apart), pinch.force]);
  else for (const [node, force] of Object.entries(head.forces).slice(-1)) if (taken[node]) {
    const d = Math.hypot(...[0, 1, 2].map((c) => points[3 * node + c] - taken[node][c]));
    history.force.push([d, Math.hypot(...force)]);
  }
  curve($("energy-curve"), history.energy.slice(-400)); curve($("force-curve"), history.force.slice(-400));
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
