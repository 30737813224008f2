// Recording: what was asked, played again.
import { $, ask } from "./common.js";

let recording = null;
export function remember(head) {
  if (!recording) return;
  const last = recording.at(-1);
  if (!last || JSON.stringify(last) !== JSON.stringify(head.asked)) recording.push(head.asked);
}
$("play").onclick = () => {
  const button = $("play");
  if (button.textContent === "Record") { recording = []; button.textContent = "Play"; button.setAttribute("aria-pressed", "true"); return; }
  const frames = recording ?? []; recording = null; button.textContent = "Record"; button.setAttribute("aria-pressed", "false");
  frames.forEach((asked, k) => setTimeout(() => { for (const [crease, angle] of Object.entries(asked)) ask({ do: "fold", crease, angle }); }, 60 * k));
};
