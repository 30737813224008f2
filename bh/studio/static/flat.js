// The flat pattern: creases to choose, dots that hold.
import { $, ask, make, now } from "./common.js";
import { light } from "./view.js";

const KEYS = { m: "mountain", v: "valley", f: "flat" };
const onKeys = (act) => (e) => { if (e.key === "Enter" || e.key === " ") { e.preventDefault(); act(); } };

export function flat(choose) {
  const svg = $("flat"), { sheet } = now, focus = svg.contains(document.activeElement) ? document.activeElement.getAttribute("aria-label") : "";
  svg.replaceChildren();
  const xs = sheet.points.filter((_, i) => i % 3 === 0), ys = sheet.points.filter((_, i) => i % 3 === 1).map((y) => -y);
  const low = [Math.min(...xs), Math.min(...ys)], size = [Math.max(...xs) - low[0], Math.max(...ys) - low[1]];
  const pad = 0.05 * Math.max(...size);
  svg.setAttribute("viewBox", [low[0] - pad, low[1] - pad, size[0] + 2 * pad, size[1] + 2 * pad].join(" "));
  const path = (pairs) => pairs.map((node, i) => `${i % 2 ? "L" : "M"}${xs[node]} ${ys[node]}`).join("");
  make("path", { d: path(sheet.boundary), class: "outline" }, svg);
  for (const crease of sheet.creases) {
    if (!crease.turns && !crease.handled) { make("path", { d: path(crease.edges), class: "crease" }, make("g", { class: crease.fold }, svg)); continue; }
    const group = make("g", { class: crease.fold, tabindex: 0, role: "button", "aria-label": `crease ${crease.name}`, "aria-description": crease.turns ? `${crease.fold}; keys M, V and F make it a mountain, a valley or flat` : `${crease.fold}: a strip that bends` }, svg);
    make("title", {}, group).textContent = `${crease.name}, ${crease.fold}`;
    make("path", { d: path(crease.edges), class: "crease" }, group);
    make("path", { d: path(crease.edges), class: "hit" }, group);
    group.dataset.crease = crease.name;
    const pick = () => choose(crease.name);
    group.onclick = pick;
    group.onkeydown = (e) => { const kind = KEYS[e.key.toLowerCase()]; if (kind && crease.turns && !e.ctrlKey && !e.metaKey) ask({ do: "crease", crease: crease.name, kind }); else onKeys(pick)(e); };
    group.onpointerenter = () => light(crease.name, true); group.onpointerleave = () => light(crease.name, false);
  }
  const rim = [...new Set(sheet.boundary)], step = Math.max(1, Math.ceil(rim.length / 60));
  for (const node of new Set([...rim.filter((_, i) => i % step === 0), ...sheet.held])) {
    const held = sheet.held.includes(node);
    const dot = make("circle", { cx: xs[node], cy: ys[node], r: 0.008 * Math.max(...size), tabindex: 0, role: "checkbox", "aria-checked": held, "aria-label": `hold node ${node}` }, svg);
    dot.classList.toggle("held", held);
    const turn = () => ask({ do: "hold", node, on: !held });
    dot.onclick = turn; dot.onkeydown = onKeys(turn);
  }
  if (focus) [...svg.querySelectorAll("[tabindex]")].find((item) => item.getAttribute("aria-label") === focus)?.focus();
}
