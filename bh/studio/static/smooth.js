// A picture with smooth edges: four samples a pixel, drawn beside the canvas and laid on it.
import * as THREE from "./vendor/three.module.min.js";

const size = new THREE.Vector2();
const beside = new THREE.WebGLRenderTarget(1, 1, { samples: 4, internalFormat: "RGBA8", colorSpace: THREE.SRGBColorSpace });
beside.isXRRenderTarget = true; // three.js then writes the colours of the canvas, and samples are averaged as the browser does
const whole = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), new THREE.ShaderMaterial({
  uniforms: { drawn: { value: beside.texture } }, blending: THREE.NoBlending, depthTest: false, depthWrite: false,
  vertexShader: "varying vec2 at; void main() { at = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }",
  fragmentShader: "uniform sampler2D drawn; varying vec2 at; void main() { gl_FragColor = texture2D(drawn, at); }",
}));
whole.frustumCulled = false;

export function smoothed(renderer, scene, camera) {
  renderer.getDrawingBufferSize(size);
  beside.setSize(size.x, size.y);
  renderer.setRenderTarget(beside); renderer.render(scene, camera);
  renderer.setRenderTarget(null); renderer.render(whole, camera);
}
