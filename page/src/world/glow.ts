/** Soft lights that face the viewer: the finish's particles, and flares where coins were. */

import {
  BufferAttribute,
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  ShaderMaterial,
} from "three";

const VERTEX = /* glsl */ `
  attribute vec4 place;   // centre, radius
  attribute vec4 light;   // colour, opacity
  varying vec2 at;
  varying vec4 shine;
  void main() {
    at = position.xy;
    shine = light;
    vec4 centre = modelViewMatrix * vec4(place.xyz, 1.0);
    gl_Position = projectionMatrix * (centre + vec4(position.xy * place.w, 0.0, 0.0));
  }
`;

const FRAGMENT = /* glsl */ `
  varying vec2 at;
  varying vec4 shine;
  void main() {
    float r = dot(at, at);
    if (r > 1.0) discard;
    float core = 1.0 - smoothstep(0.0, 0.22, r);
    float fall = 1.0 - r;
    gl_FragColor = vec4(mix(shine.rgb, vec3(1.0), core), shine.a * fall * (0.55 + 0.45 * core));
  }
`;

/** Up to so many lights, drawn together. */
export class Glows {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private readonly places: InstancedBufferAttribute;
  private readonly lights: InstancedBufferAttribute;
  private count = 0;

  constructor(private readonly capacity: number) {
    const geometry = new InstancedBufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]);
    geometry.setAttribute("position", new BufferAttribute(corners, 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    this.places = new InstancedBufferAttribute(new Float32Array(4 * capacity), 4);
    this.lights = new InstancedBufferAttribute(new Float32Array(4 * capacity), 4);
    this.places.setUsage(DynamicDrawUsage);
    this.lights.setUsage(DynamicDrawUsage);
    geometry.setAttribute("place", this.places);
    geometry.setAttribute("light", this.lights);
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
    });
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 3;
  }

  begin(): void {
    this.count = 0;
  }

  /** Add a light: its centre and radius, metres, colour as seen, and opacity, 0 to 1. */
  add(
    x: number,
    y: number,
    z: number,
    radius: number,
    colour: readonly [number, number, number],
    opacity: number,
  ): void {
    if (this.count === this.capacity) return;
    this.places.setXYZW(this.count, x, y, z, radius);
    this.lights.setXYZW(this.count, ...colour, opacity);
    this.count++;
  }

  end(): void {
    this.mesh.geometry.instanceCount = this.count;
    this.mesh.visible = this.count > 0;
    this.places.needsUpdate = true;
    this.lights.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
