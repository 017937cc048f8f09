/** Materials of a scene: tiles in world scale, bright rims of slabs, glass, metal and light. */

import {
  ClampToEdgeWrapping,
  Color,
  DataTexture,
  DoubleSide,
  FrontSide,
  LinearFilter,
  LinearMipmapLinearFilter,
  LinearMipmapNearestFilter,
  type Material,
  MeshStandardMaterial,
  NoColorSpace,
  RepeatWrapping,
  SRGBColorSpace,
} from "three";
import type { Material as LevelMaterial, Paint, Scene } from "../types";
import { SimpleMaterial } from "./simple";

type Rgb = readonly [number, number, number];

const TILE_PIXELS = 256;
const CHECKS_PER_TILE = 2;

/** Height of the bright rim round a slab, in tiles: two and a half quants of 64. */
const RIM_TILES = 2.5 / 64;

/** Brightness of a slab's edge below the rim, by depth in tiles. */
const EDGE_SHADES: readonly (readonly [number, number])[] = [
  [0, 0.72],
  [0.25, 0.5],
  [1, 0.34],
];

const WHITE: Rgb = [1, 1, 1];

/** How the sky is reflected, where it is reflected at all. */
const FLOOR_ROUGHNESS = 0.55;
const EDGE_ROUGHNESS = 0.7;
/** Glass shines a little, or it would look like smoke. */
const GLASS = { roughness: 0.08, emission: 0.2 };

interface Look {
  colour: Rgb;
  /** Opacity of a face. */
  alpha: number;
  map: DataTexture | null;
  roughness: number;
  emission?: number;
  metalness?: number;
}

/** The materials of a scene, each made once. */
export class Paints {
  private readonly made = new Map<string, Material>();
  private readonly textures: DataTexture[] = [];

  /**
   * @param rich - whether light is worked out for each pixel and the sky is reflected.
   * @param anisotropy - samples with which tiles are drawn that are looked along.
   */
  constructor(
    private readonly scene: Scene,
    private readonly rich: boolean,
    private readonly anisotropy: number,
  ) {}

  /** Return the material of a shape's look, or of a level's material. */
  get(name: string, isMaterial: boolean): Material {
    return this.once(`${isMaterial} ${name}`, () =>
      isMaterial ? this.tiles(this.levelMaterial(name)) : this.paint(name),
    );
  }

  /** Return the material of the sides of slabs of a level's material. */
  edge(name: string): Material {
    return this.once(`edge ${name}`, () => this.rim(this.levelMaterial(name)));
  }

  dispose(): void {
    for (const material of this.made.values()) material.dispose();
    for (const texture of this.textures) texture.dispose();
  }

  private once(key: string, make: () => Material): Material {
    let material = this.made.get(key);
    if (material === undefined) {
      material = make();
      this.made.set(key, material);
    }
    return material;
  }

  private levelMaterial(name: string): LevelMaterial {
    const material = this.scene.materials[name];
    if (material === undefined) throw new RangeError(`the scene has no material ${name}`);
    return material;
  }

  private tiles({ colour, pattern }: LevelMaterial): Material {
    const { rgb, alpha } = parseColour(colour);
    return this.body({
      colour: pattern === "plain" ? rgb : WHITE,
      alpha: faceAlpha(alpha),
      map: pattern === "plain" ? null : this.texture(TILE_PIXELS, tilePixels(rgb, pattern)),
      ...(alpha < 1 ? GLASS : { roughness: FLOOR_ROUGHNESS }),
    });
  }

  private rim({ colour }: LevelMaterial): Material {
    const { rgb, alpha } = parseColour(colour);
    const map = this.texture(4, rimPixels(rgb, 4));
    map.wrapT = ClampToEdgeWrapping;
    return this.body({ colour: WHITE, alpha: faceAlpha(alpha), map, roughness: EDGE_ROUGHNESS });
  }

  private paint(name: string): Material {
    const paint: Paint | undefined = this.scene.paints[name];
    if (paint === undefined) throw new RangeError(`the scene has no paint ${name}`);
    const { rgb, alpha } = parseColour(paint.colour);
    return this.body({
      colour: rgb,
      alpha: paint.opacity < 1 ? faceAlpha(paint.opacity) : alpha,
      map: paint.texture === "chequers" ? this.texture(64, chequeredPixels(64)) : null,
      emission: paint.emission,
      roughness: 1 - 0.8 * paint.shininess,
      metalness: paint.specular > 0.5 ? 0.6 : 0,
    });
  }

  private body({ colour, alpha, map, roughness, emission = 0, metalness = 0 }: Look): Material {
    if (!this.rich) return new SimpleMaterial(colour, alpha, emission, map);
    const color = new Color().setRGB(...colour, SRGBColorSpace);
    const seenThrough = alpha < 1;
    return new MeshStandardMaterial({
      color,
      map,
      emissive: color,
      emissiveMap: map,
      emissiveIntensity: emission,
      roughness,
      metalness,
      opacity: alpha,
      transparent: seenThrough,
      // What is behind glass is seen through both of its sides.
      depthWrite: !seenThrough,
      side: seenThrough ? DoubleSide : FrontSide,
    });
  }

  private texture(width: number, pixels: Uint8Array<ArrayBuffer>): DataTexture {
    const texture = new DataTexture(pixels, width, pixels.length / 4 / width);
    texture.colorSpace = this.rich ? SRGBColorSpace : NoColorSpace;
    texture.wrapS = texture.wrapT = RepeatWrapping;
    texture.magFilter = LinearFilter;
    texture.minFilter = this.rich ? LinearMipmapLinearFilter : LinearMipmapNearestFilter;
    texture.generateMipmaps = true;
    texture.anisotropy = this.anisotropy;
    texture.needsUpdate = true;
    this.textures.push(texture);
    return texture;
  }
}

/** Return red, green and blue of `#rrggbb` or `#rrggbbaa`, and alpha, all 0 to 1. */
export function parseColour(colour: string): { rgb: Rgb; alpha: number } {
  const part = (i: number) => Number.parseInt(colour.slice(1 + 2 * i, 3 + 2 * i), 16) / 255;
  return { rgb: [part(0), part(1), part(2)], alpha: colour.length > 7 ? part(3) : 1 };
}

/** Return the opacity of each face of a body that is to have one as a whole. */
function faceAlpha(alpha: number): number {
  return 1 - Math.sqrt(1 - alpha);
}

/** Return one tile of a floor: two by two checks, or squares of a grid. */
function tilePixels(base: Rgb, pattern: "checker" | "grid"): Uint8Array<ArrayBuffer> {
  const grid = pattern === "grid";
  const joint = grid ? towardsWhite(base, 0.45) : scaled(base, 0.62);
  const strength = grid ? 0.75 : 0.5;
  const checks = grid ? [base, base] : [towardsWhite(base, 0.16), scaled(base, 0.86)];
  return pixelsOf(TILE_PIXELS, TILE_PIXELS, (x, y) => {
    const [column, row] = [x * CHECKS_PER_TILE, y * CHECKS_PER_TILE];
    const check = checks[(Math.floor(column) + Math.floor(row)) % 2] ?? base;
    const edge = Math.min(toEdge(column), toEdge(row));
    // In squares; a joint is some three pixels wide, whatever the tile's size.
    const line = clamp(1.5 - (edge * TILE_PIXELS) / CHECKS_PER_TILE / 2);
    // A light that falls off towards the joints makes the squares look like tiles.
    const shade = 1 - 0.1 * Math.exp(-edge / 0.06);
    return mixed(scaled(check, shade), joint, strength * line);
  });
}

/** Return the side of a slab, from its upper rim down: bright first, and then darkening. */
function rimPixels(base: Rgb, width: number): Uint8Array<ArrayBuffer> {
  return pixelsOf(width, TILE_PIXELS, (_, depth) => {
    const rim = clamp((RIM_TILES - depth) * TILE_PIXELS);
    return mixed(scaled(base, interpolated(EDGE_SHADES, depth)), towardsWhite(base, 0.6), rim);
  });
}

/** Return a black and white board of two by two. */
function chequeredPixels(size: number): Uint8Array<ArrayBuffer> {
  return pixelsOf(size, size, (x, y) => {
    const bright = (Math.floor(2 * x) + Math.floor(2 * y)) % 2 === 0 ? 0.96 : 0.06;
    return [bright, bright, bright];
  });
}

/** Return an image of which `colour` says each pixel's, given its middle, 0 to 1. */
function pixelsOf(
  width: number,
  height: number,
  colour: (x: number, y: number) => Rgb,
): Uint8Array<ArrayBuffer> {
  const pixels = new Uint8Array(4 * width * height);
  for (let row = 0, i = 0; row < height; row++) {
    for (let column = 0; column < width; column++) {
      for (const part of colour((column + 0.5) / width, (row + 0.5) / height)) {
        pixels[i++] = Math.round(255 * clamp(part));
      }
      pixels[i++] = 255;
    }
  }
  return pixels;
}

function toEdge(place: number): number {
  const within = place - Math.floor(place);
  return Math.min(within, 1 - within);
}

function interpolated(stops: readonly (readonly [number, number])[], at: number): number {
  let [before, low] = stops[0] ?? [0, 0];
  for (const [after, high] of stops) {
    if (at < after) return low + ((high - low) * (at - before)) / (after - before);
    [before, low] = [after, high];
  }
  return low;
}

function mixed(from: Rgb, to: Rgb, share: number): Rgb {
  return [
    from[0] + share * (to[0] - from[0]),
    from[1] + share * (to[1] - from[1]),
    from[2] + share * (to[2] - from[2]),
  ];
}

function towardsWhite(colour: Rgb, share: number): Rgb {
  return mixed(colour, [1, 1, 1], share);
}

function scaled(colour: Rgb, by: number): Rgb {
  return [by * colour[0], by * colour[1], by * colour[2]];
}

function clamp(value: number): number {
  return Math.min(Math.max(value, 0), 1);
}
