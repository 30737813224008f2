// Draws the frames of bh.interactive with plotly.js: one scene a model, one slider, one scale of colours.
"use strict";
(() => {
  const decode = (text, Type) => new Type(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const number = (v) => (v === 0 ? "0" : Math.abs(v) >= 1e-3 && Math.abs(v) < 1e4 ? v.toPrecision(3) : v.toExponential(2));

  function unpack(model) {
    const nodes = decode(model.nodes, Int32Array);
    const triangles = decode(model.triangles, Int32Array);
    const every = (start) => Array.from({ length: triangles.length / 3 }, (_, t) => triangles[3 * t + start]);
    const density = Object.fromEntries(Object.entries(model.density).map(([k, v]) => [k, decode(v, Float32Array)]));
    return { name: model.name, nodes, density, energy: model.energy, points: decode(model.points, Float32Array),
      corners: [every(0), every(1), every(2)],
      outline: decode(model.outline, Int32Array) };
  }

  // the values of one axis at one frame: by corner of the cut sheet, or along pairs of nodes with gaps between them
  function axis(model, frame, frames, which) {
    const n = model.points.length / 3 / frames, at = (node) => model.points[3 * (frame * n + node) + which];
    const pairs = (list) => {
      const out = new Array(1.5 * list.length);
      for (let e = 0; e < list.length / 2; e++) {
        out[3 * e] = at(list[2 * e]); out[3 * e + 1] = at(list[2 * e + 1]); out[3 * e + 2] = null;
      }
      return out;
    };
    return { surface: Array.from(model.nodes, at), outline: pairs(model.outline) };
  }

  function densities(model, frame, frames, kind) {
    const one = (values) => {
      const n = values.length / frames;
      return Array.from(model.nodes, (node) => values[frame * n + node]);
    };
    if (kind !== "total") return kind in model.density ? one(model.density[kind]) : Array.from(model.nodes, () => 0);
    const all = Object.values(model.density).map(one);
    return all[0].map((_, i) => all.reduce((sum, values) => sum + values[i], 0));
  }

  function bounds(models) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const model of models)
      for (let i = 0; i < model.points.length; i++) {
        low[i % 3] = Math.min(low[i % 3], model.points[i]); high[i % 3] = Math.max(high[i % 3], model.points[i]);
      }
    const most = Math.max(...high.map((h, i) => h - low[i])), pad = 0.02 * most;
    const ranges = low.map((l, i) => [l - pad, high[i] + pad]);
    return { ranges, sizes: ranges.map((r) => (r[1] - r[0]) / most), most };
  }

  // width and height of all that is to be seen from `eye` (a unit vector), as parts of `most`
  function extent(models, eye, most) {
    const flat = Math.hypot(eye[0], eye[1]) || 1, across = [-eye[1] / flat, eye[0] / flat, 0];
    const up = [eye[1] * across[2] - eye[2] * across[1], eye[2] * across[0] - eye[0] * across[2], eye[0] * across[1] - eye[1] * across[0]];
    return [across, up].map((along) => {
      let low = Infinity, high = -Infinity;
      for (const { points } of models)
        for (let i = 0; i < points.length; i += 3) {
          const s = points[i] * along[0] + points[i + 1] * along[1] + points[i + 2] * along[2];
          low = Math.min(low, s); high = Math.max(high, s);
        }
      return (high - low) / most;
    });
  }

  function look(box) {
    const css = getComputedStyle(box), get = (name, other) => css.getPropertyValue(name).trim() || other;
    return { ink: get("--ink", css.color), soft: get("--soft", css.color) };
  }

  function setUp(box) {
    const data = JSON.parse(box.querySelector("script.frames").textContent);
    const models = data.models.map(unpack), frames = data.lambdas.length;
    const canvas = box.querySelector(".canvas"), slider = box.querySelector("input[type=range]");
    const output = box.querySelector("output"), kindBox = box.querySelector("select"), play = box.querySelector("button");
    const energies = box.querySelector(".energies"), { ranges, sizes, most } = bounds(models);
    const [wide, high] = extent(models, data.eye, most);
    const kind = () => kindBox.value, frame = () => Number(slider.value);
    const top = () => (kind() === "total" ? Object.values(data.tops).reduce((a, b) => a + b, 0) : data.tops[kind()]) || 1;
    const stacked = () => box.clientWidth < 560 && models.length > 1;
    const HALF = 1.1; // what plotly shows of a scene above and below its middle, in units of the aspect ratio

    function layout() {
      const { ink } = look(box), count = models.length, height = stacked() ? 250 * count + 70 : count > 1 ? 380 : 430;
      const part = stacked() ? [box.clientWidth, 250] : [box.clientWidth / count, 0.86 * height];
      const zoom = 0.88 * 2 * HALF * Math.min(1 / high, part[0] / part[1] / wide);
      const result = {
        margin: { l: 0, r: 0, t: 4, b: 0 }, showlegend: false, paper_bgcolor: "rgba(0,0,0,0)", annotations: [],
        height, font: { color: ink, family: "system-ui, sans-serif", size: 13 },
        hoverlabel: { font: { family: "system-ui, sans-serif" } },
      };
      models.forEach((model, m) => {
        const hidden = (i) => ({ visible: false, range: ranges[i], autorange: false });
        const place = stacked() ? { x: [0, 1], y: [0.1 + (0.9 * (count - 1 - m)) / count, 0.1 + (0.9 * (count - m)) / count] }
          : { x: [m / count, (m + 1) / count], y: [0.14, 1] };
        result["scene" + (m ? m + 1 : "")] = {
          domain: place, xaxis: hidden(0), yaxis: hidden(1), zaxis: hidden(2), aspectmode: "manual",
          aspectratio: { x: zoom * sizes[0], y: zoom * sizes[1], z: zoom * sizes[2] }, dragmode: "orbit",
          camera: { projection: { type: "orthographic" }, up: { x: 0, y: 0, z: 1 }, center: { x: 0, y: 0, z: 0 },
            eye: { x: 2 * data.eye[0], y: 2 * data.eye[1], z: 2 * data.eye[2] } },
        };
        if (count > 1)
          result.annotations.push({ text: model.name, showarrow: false, xref: "paper", yref: "paper", x: place.x[0], xanchor: "left",
            y: place.y[1], yanchor: "top", font: { color: ink, size: 14 } });
      });
      return result;
    }

    function traces() {
      const { ink, soft } = look(box), found = [];
      models.forEach((model, m) => {
        const scene = "scene" + (m ? m + 1 : ""), [x, y, z] = [0, 1, 2].map((i) => axis(model, frame(), frames, i));
        found.push({ type: "mesh3d", scene, x: x.surface, y: y.surface, z: z.surface, i: model.corners[0], j: model.corners[1],
          k: model.corners[2], intensity: densities(model, frame(), frames, kind()), colorscale: "Viridis", cmin: 0, cmax: top(),
          lighting: { ambient: 0.72, diffuse: 0.45, specular: 0.05, roughness: 0.9, fresnel: 0 }, flatshading: false,
          lightposition: { x: 2000, y: -3000, z: 9000 }, name: model.name,
          hovertemplate: "%{intensity:.3g} N mm / mm²<extra>" + model.name + "</extra>", showscale: m === 0,
          colorbar: { orientation: "h", x: 0.5, xanchor: "center", y: 0, yanchor: "bottom", len: stacked() ? 0.9 : 0.5, thickness: 10,
            title: { text: "energy density, N mm / mm²", side: "top", font: { color: ink, size: 12 } }, tickfont: { color: ink, size: 11 },
            nticks: 5, exponentformat: "power", outlinewidth: 0 } });
        found.push({ type: "scatter3d", mode: "lines", scene, x: x.outline, y: y.outline, z: z.outline,
          line: { color: soft, width: 4 }, hoverinfo: "skip", connectgaps: false });
      });
      return found;
    }

    function tell() {
      output.textContent = number(data.lambdas[frame()]);
      slider.setAttribute("aria-valuetext", data.label + " " + output.textContent);
      energies.textContent = kind()[0].toUpperCase() + kind().slice(1) + " energy, N mm: " + models.map((model) => {
        const value = model.energy[kind()];
        return (models.length > 1 ? model.name + " " : "") + (value ? number(value[frame()]) : "0");
      }).join(" · ");
    }

    let drawn = false, busy = false, again = false;
    async function draw() {
      if (!drawn) return;
      if (busy) { again = true; return; }
      busy = true;
      tell();
      await Plotly.react(canvas, traces(), views(), { displayModeBar: false, responsive: true });
      box.dataset.frame = String(frame());
      busy = false;
      if (again) { again = false; draw(); }
    }
    // the cameras as they are, so that drawing anew does not turn the sheets back
    let camera = null;
    function views() {
      const result = layout();
      if (camera) models.forEach((_, m) => { result["scene" + (m ? m + 1 : "")].camera = camera; });
      return result;
    }

    async function begin() {
      drawn = true;
      box.querySelector(".controls").hidden = false;
      box.classList.add("live");
      await draw();
      box.dataset.ready = "yes";
      canvas.on("plotly_relayout", (change) => {
        const key = Object.keys(change).find((name) => name.endsWith(".camera"));
        if (!key) return;
        camera = change[key];
        draw();
      });
      slider.addEventListener("input", draw);
      kindBox.addEventListener("change", draw);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
      // pages with a switch of their own between light and dark write it there
      new MutationObserver(draw).observe(document.body, { attributes: true, attributeFilter: ["data-theme", "class"] });
      let width = box.clientWidth;
      addEventListener("resize", () => { if (box.clientWidth !== width) { width = box.clientWidth; draw(); } });
      let timer = 0;
      play.addEventListener("click", () => {
        if (timer) { clearInterval(timer); timer = 0; play.textContent = "Play"; return; }
        play.textContent = "Stop";
        if (frame() === frames - 1) slider.value = 0;
        timer = setInterval(() => {
          slider.value = frame() + 1;
          draw();
          if (frame() === frames - 1) play.click();
        }, 350);
      });
    }

    // drawn when it comes into view: a browser has only so many WebGL contexts
    new IntersectionObserver((entries, observer) => {
      if (entries.some((entry) => entry.isIntersecting)) { observer.disconnect(); begin(); }
    }, { rootMargin: "200px" }).observe(box);
  }

  document.querySelectorAll(".sheet3d").forEach(setUp);
})();
