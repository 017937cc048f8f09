/**
 * A material for machines that draw without a graphics card: what light falls on a corner is worked
 * out there, and a pixel costs no more than its texture. Colours are as seen, never linear.
 */

import { DoubleSide, FrontSide, ShaderMaterial, type Texture, Vector4 } from "three";

/** Lights as in the game's own pictures: directions are those in which the light falls. */
const LIGHT = /* glsl */ `
  vec3 lightOn(vec3 normal) {
    vec3 sun = vec3(0.72, 0.69, 0.62) * max(dot(normal, -normalize(vec3(0.42, -0.30, -0.86))), 0.0);
    vec3 sky = vec3(0.16, 0.20, 0.28) * max(dot(normal, -normalize(vec3(-0.5, 0.6, 0.35))), 0.0);
    return vec3(0.40, 0.42, 0.46) + sun + sky;
  }
`;

const VERTEX = /* glsl */ `
  uniform vec4 colour;
  uniform float emission;
  varying vec3 lit;
  varying vec2 at;
  ${LIGHT}
  void main() {
    mat4 place = modelMatrix;
    #ifdef USE_INSTANCING
      place = place * instanceMatrix;
    #endif
    // Scaled unevenly: a normal is divided by what a body is multiplied by.
    mat3 turn = mat3(place);
    vec3 scale = vec3(dot(turn[0], turn[0]), dot(turn[1], turn[1]), dot(turn[2], turn[2]));
    vec3 direction = normalize(turn * (normal / max(scale, vec3(1e-12))));
    lit = colour.rgb * min(lightOn(direction) + emission, vec3(1.6));
    at = uv;
    gl_Position = projectionMatrix * viewMatrix * place * vec4(position, 1.0);
  }
`;

const FRAGMENT = /* glsl */ `
  uniform vec4 colour;
  varying vec3 lit;
  varying vec2 at;
  #ifdef TEXTURED
    uniform sampler2D image;
  #endif
  void main() {
    vec3 seen = lit;
    #ifdef TEXTURED
      seen *= texture2D(image, at).rgb;
    #endif
    gl_FragColor = vec4(seen, colour.a);
  }
`;

export class SimpleMaterial extends ShaderMaterial {
  /**
   * @param rgb - colour, 0 to 1, as seen; multiplies the texture.
   * @param opacity - 0 to 1.
   * @param emission - share of the colour that is seen without any light.
   * @param image - texture, if any.
   */
  constructor(
    rgb: readonly [number, number, number],
    opacity = 1,
    emission = 0,
    image: Texture | null = null,
  ) {
    super({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: {
        colour: { value: new Vector4(...rgb, opacity) },
        emission: { value: emission },
        image: { value: image },
      },
      defines: image ? { TEXTURED: "" } : {},
      transparent: opacity < 1,
      depthWrite: opacity === 1,
      side: opacity < 1 ? DoubleSide : FrontSide,
    });
    this.opacity = opacity;
    // A shader of one's own is told of its opacity by nobody else.
    this.onBeforeRender = () => {
      (this.uniforms.colour?.value as Vector4).w = this.opacity;
      this.uniformsNeedUpdate = true;
    };
  }
}
