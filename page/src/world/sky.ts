/** The sky: deep blue overhead, haze at the horizon, a sea of cloud below. Painted once. */

import {
  BackSide,
  BoxGeometry,
  CubeCamera,
  HalfFloatType,
  Mesh,
  Scene,
  ShaderMaterial,
  UnsignedByteType,
  type Vector3,
  WebGLCubeRenderTarget,
  type WebGLRenderer,
} from "three";

const PIXELS = 512;
const REFLECTED_PIXELS = 128;

const FRAGMENT = /* glsl */ `
  varying vec3 direction;
  uniform vec3 towardsSun;
  uniform bool linear;

  float hash(vec2 p) {
    vec3 q = fract(vec3(p.xyx) * 0.1031);
    q += dot(q, q.yzx + 33.33);
    return fract((q.x + q.y) * q.z);
  }

  float noise(vec2 p) {
    vec2 cell = floor(p), f = fract(p);
    vec2 u = f * f * (3.0 - 2.0 * f);
    return mix(
      mix(hash(cell), hash(cell + vec2(1.0, 0.0)), u.x),
      mix(hash(cell + vec2(0.0, 1.0)), hash(cell + vec2(1.0, 1.0)), u.x), u.y);
  }

  float layers(vec2 p) {
    float sum = 0.0, weight = 0.5;
    for (int i = 0; i < 6; i++) {
      sum += weight * noise(p);
      p = mat2(1.6, 1.2, -1.2, 1.6) * p + 7.3;
      weight *= 0.52;
    }
    return sum;
  }

  vec3 gradient(float up) {
    vec3 colour = vec3(0.17, 0.32, 0.52);
    colour = mix(colour, vec3(0.36, 0.55, 0.74), smoothstep(-1.0, -0.45, up));
    colour = mix(colour, vec3(0.72, 0.83, 0.92), smoothstep(-0.45, -0.08, up));
    colour = mix(colour, vec3(0.95, 0.95, 0.92), smoothstep(-0.08, 0.0, up));
    colour = mix(colour, vec3(0.70, 0.84, 0.95), smoothstep(0.0, 0.12, up));
    colour = mix(colour, vec3(0.33, 0.60, 0.88), smoothstep(0.12, 0.45, up));
    return mix(colour, vec3(0.13, 0.34, 0.68), smoothstep(0.45, 1.0, up));
  }

  void main() {
    vec3 look = normalize(direction);
    vec3 sky = gradient(look.z);
    // Looking along a layer of cloud squeezes it: the layer is a plane over and under the viewer.
    vec2 flat_ = look.xy / (abs(look.z) + 0.22) * 1.6;
    vec2 bend = vec2(layers(flat_ + 3.1), layers(flat_ - 5.7));
    float thick = layers(flat_ + 0.8 * bend);
    float cover = smoothstep(0.47, 0.78, thick) * smoothstep(0.02, 0.2, abs(look.z));
    float shade = 1.0 - smoothstep(0.5, 0.9, thick);
    vec3 cloud = mix(vec3(0.80, 0.86, 0.93), vec3(1.0, 0.995, 0.98), shade);
    sky = mix(sky, cloud, 0.85 * cover);
    float sun = max(dot(look, towardsSun), 0.0);
    sky += vec3(1.0, 0.93, 0.78) * (0.22 * pow(sun, 24.0) + smoothstep(0.9993, 0.9997, sun));
    // Colours above are as seen.
    gl_FragColor = vec4(linear ? pow(min(sky, 1.0), vec3(2.2)) : sky, 1.0);
  }
`;

const VERTEX = /* glsl */ `
  varying vec3 direction;
  void main() {
    direction = position;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }
`;

const SEEN_VERTEX = /* glsl */ `
  varying vec3 direction;
  void main() {
    direction = position;
    gl_Position = projectionMatrix * vec4(mat3(viewMatrix) * position, 1.0);
    // Behind everything, so that only what is seen of it is drawn.
    gl_Position.z = gl_Position.w;
  }
`;

const SEEN_FRAGMENT = /* glsl */ `
  uniform samplerCube sky;
  varying vec3 direction;
  void main() {
    gl_FragColor = vec4(textureCube(sky, direction).rgb, 1.0);
  }
`;

/**
 * Paint the sky.
 *
 * @param renderer - to paint with.
 * @param towardsSun - unit vector.
 * @param linear - whether light is wanted, as of what is reflected, not colours as seen.
 */
export function paintSky(
  renderer: WebGLRenderer,
  towardsSun: Vector3,
  linear: boolean,
): WebGLCubeRenderTarget {
  const target = new WebGLCubeRenderTarget(linear ? REFLECTED_PIXELS : PIXELS, {
    type: linear ? HalfFloatType : UnsignedByteType,
  });
  const material = new ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    side: BackSide,
    uniforms: { towardsSun: { value: towardsSun }, linear: { value: linear } },
  });
  const geometry = new BoxGeometry(10, 10, 10);
  const scene = new Scene();
  scene.add(new Mesh(geometry, material));
  new CubeCamera(0.1, 20, target).update(renderer, scene);
  geometry.dispose();
  material.dispose();
  return target;
}

/** Return what is seen behind everything. */
export function skyMesh(sky: WebGLCubeRenderTarget): Mesh {
  const material = new ShaderMaterial({
    vertexShader: SEEN_VERTEX,
    fragmentShader: SEEN_FRAGMENT,
    side: BackSide,
    depthWrite: false,
    uniforms: { sky: { value: sky.texture } },
  });
  const mesh = new Mesh(new BoxGeometry(2, 2, 2), material);
  mesh.frustumCulled = false;
  mesh.renderOrder = 1;
  return mesh;
}
