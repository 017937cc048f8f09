/** What stands in the way: the ground below a point, and how far one sees from the ball. */

import { Matrix4, Vector3 } from "three";
import type { Frame, Scene, Shape } from "../types";
import { Forms, placeOf, scaleOf } from "./geometry";
import { parseColour } from "./paint";

/** Edge of the squares of the plane in which triangles are found again. */
const CELL_M = 2;

/** Steeper than this is a wall, on which no shadow falls from above. */
const LEAST_SLOPE = 0.2;

/** A ground that the ball's centre has just sunk below is still below it. */
const SUNK_M = 0.05;

export interface Ground {
  /** z, metres. */
  height: number;
  normal: Vector3;
}

interface Block {
  shape: Shape;
  half: Vector3;
  /** From the world's frame to the block's at displacement 0. */
  inverse: Matrix4;
  along: Vector3;
  offset: Vector3;
}

/** The solids of a scene: triangles of what stands, and boxes that move. */
export class Solids {
  private readonly corners: Float32Array;
  private readonly normals: Float32Array;
  private readonly seenThrough: Uint8Array;
  private readonly cells = new Map<number, number[]>();
  private readonly stamps: Uint32Array;
  private stamp = 0;
  private readonly blocks: Block[];
  private readonly ground: Ground = { height: 0, normal: new Vector3() };

  constructor(scene: Scene) {
    const { corners, seenThrough } = trianglesOf(scene);
    const count = seenThrough.length;
    this.corners = Float32Array.from(corners);
    this.seenThrough = Uint8Array.from(seenThrough);
    this.normals = new Float32Array(3 * count);
    this.stamps = new Uint32Array(count);
    for (let i = 0; i < count; i++) this.enter(i);
    this.blocks = scene.shapes
      .filter((shape) => shape.mover >= 0 && shape.form === "box" && shape.machine < 0)
      .map((shape) => blockOf(scene, shape));
  }

  /** Move what moves to where it is in a frame. */
  show(frame: Frame): void {
    for (const { shape, along, offset } of this.blocks) {
      offset.copy(along).multiplyScalar(frame.displacements[shape.mover] ?? 0);
    }
  }

  /** Return the highest ground straight below a point, or null; valid until the next call. */
  below(point: Vector3): Ground | null {
    const { corners: c, normals: n, ground } = this;
    ground.height = Number.NEGATIVE_INFINITY;
    for (const i of this.cells.get(cellOf(point.x, point.y)) ?? []) {
      const up = n[3 * i + 2] as number;
      const height = up > LEAST_SLOPE ? heightAt(c, 9 * i, n, 3 * i, point.x, point.y) : Number.NaN;
      if (height <= point.z + SUNK_M && height > ground.height) {
        ground.height = height;
        ground.normal.fromArray(n, 3 * i);
      }
    }
    for (const block of this.blocks) {
      const share = reach(block, point, DOWN);
      const height = point.z + share * DOWN.z;
      if (share < 1 && height > ground.height) {
        ground.height = height;
        ground.normal.set(0, 0, 1);
      }
    }
    return ground.height === Number.NEGATIVE_INFINITY ? null : ground;
  }

  /** Return the share, 0 to 1, of a way from a point that is free of what cannot be seen through. */
  free(from: Vector3, way: Vector3): number {
    let free = 1;
    for (const block of this.blocks) free = Math.min(free, reach(block, from, way));
    this.stamp++;
    const [x0, x1] = ordered(from.x, from.x + way.x);
    const [y0, y1] = ordered(from.y, from.y + way.y);
    for (let x = Math.floor(x0 / CELL_M); x <= Math.floor(x1 / CELL_M); x++) {
      for (let y = Math.floor(y0 / CELL_M); y <= Math.floor(y1 / CELL_M); y++) {
        for (const i of this.cells.get(key(x, y)) ?? []) {
          if (this.stamps[i] === this.stamp || this.seenThrough[i]) continue;
          this.stamps[i] = this.stamp;
          free = Math.min(free, hit(this.corners, 9 * i, from, way));
        }
      }
    }
    return free;
  }

  /** Enter a triangle into the cells that it reaches over. */
  private enter(i: number): void {
    const [a, b, c] = [0, 3, 6].map((k) => new Vector3().fromArray(this.corners, 9 * i + k)) as [
      Vector3,
      Vector3,
      Vector3,
    ];
    const normal = new Vector3().crossVectors(b.clone().sub(a), c.clone().sub(a)).normalize();
    normal.toArray(this.normals, 3 * i);
    const [x0, x1] = [Math.min(a.x, b.x, c.x), Math.max(a.x, b.x, c.x)];
    const [y0, y1] = [Math.min(a.y, b.y, c.y), Math.max(a.y, b.y, c.y)];
    for (let x = Math.floor(x0 / CELL_M); x <= Math.floor(x1 / CELL_M); x++) {
      for (let y = Math.floor(y0 / CELL_M); y <= Math.floor(y1 / CELL_M); y++) {
        const cell = this.cells.get(key(x, y));
        if (cell) cell.push(i);
        else this.cells.set(key(x, y), [i]);
      }
    }
  }
}

function blockOf(scene: Scene, shape: Shape): Block {
  const half = scaleOf(shape);
  const place = placeOf({ ...shape, size: [1, 1, 1] });
  const along = new Vector3(...(scene.movers[shape.mover]?.along ?? [0, 0, 0]));
  return { shape, half, inverse: place.invert(), along, offset: new Vector3() };
}

/** Return the triangles of all that stands still and stops a ball, and whether one sees through. */
function trianglesOf(scene: Scene): { corners: number[]; seenThrough: number[] } {
  const forms = new Forms(scene);
  const corners: number[] = [];
  const seenThrough: number[] = [];
  const point = new Vector3();
  const add = (form: Shape["form"], place: Matrix4, glass: boolean) => {
    const geometry = forms.get(form);
    const positions = geometry.getAttribute("position");
    const index = geometry.getIndex();
    for (let i = 0; index && i < index.count; i++) {
      point.fromBufferAttribute(positions, index.getX(i)).applyMatrix4(place);
      corners.push(point.x, point.y, point.z);
      if (i % 3 === 2) seenThrough.push(glass ? 1 : 0);
    }
  };
  const isGlass = (material: string) =>
    parseColour(scene.materials[material]?.colour ?? "#000000").alpha < 1;
  for (const { surface, material } of scene.ground) {
    add(surface, new Matrix4(), isGlass(material));
  }
  for (const shape of scene.shapes) {
    if (shape.mover >= 0 || shape.machine >= 0 || shape.coin >= 0 || shape.motion) continue;
    if (shape.is_material) add(shape.form, placeOf(shape), isGlass(shape.look[0] ?? ""));
    else if (shape.look[0] === "metal/") add(shape.form, placeOf(shape), false);
  }
  forms.dispose();
  return { corners, seenThrough };
}

/** Return z of a triangle over a point of the plane, or NaN beside it. */
function heightAt(
  c: Float32Array,
  at: number,
  n: Float32Array,
  normalAt: number,
  x: number,
  y: number,
): number {
  const number = (i: number) => c[at + i] as number;
  for (let k = 0; k < 3; k++) {
    const [i, j] = [3 * k, 3 * ((k + 1) % 3)];
    const side =
      (number(j) - number(i)) * (y - number(i + 1)) -
      (number(j + 1) - number(i + 1)) * (x - number(i));
    if (side < 0) return Number.NaN;
  }
  const [nx, ny, nz] = [n[normalAt], n[normalAt + 1], n[normalAt + 2]] as [number, number, number];
  return number(2) - (nx * (x - number(0)) + ny * (y - number(1))) / nz;
}

/** Return the share of a way up to a triangle, seen from either side, or 1 (Moeller, Trumbore). */
function hit(c: Float32Array, at: number, from: Vector3, way: Vector3): number {
  A.fromArray(c, at);
  E1.fromArray(c, at + 3).sub(A);
  E2.fromArray(c, at + 6).sub(A);
  P.crossVectors(way, E2);
  const determinant = E1.dot(P);
  if (Math.abs(determinant) < 1e-9) return 1;
  T.subVectors(from, A);
  const u = T.dot(P) / determinant;
  if (u < 0 || u > 1) return 1;
  Q.crossVectors(T, E1);
  const v = way.dot(Q) / determinant;
  if (v < 0 || u + v > 1) return 1;
  const share = E2.dot(Q) / determinant;
  return share > 0 && share < 1 ? share : 1;
}

/** Return the share of a way up to a block, or 1. */
function reach(block: Block, from: Vector3, way: Vector3): number {
  A.subVectors(from, block.offset).applyMatrix4(block.inverse);
  P.copy(way).transformDirection(block.inverse).multiplyScalar(way.length());
  let [enter, leave] = [0, 1];
  for (const axis of ["x", "y", "z"] as const) {
    if (Math.abs(P[axis]) < 1e-9) {
      if (Math.abs(A[axis]) > block.half[axis]) return 1;
      continue;
    }
    const [near, far] = ordered(
      (-block.half[axis] - A[axis]) / P[axis],
      (block.half[axis] - A[axis]) / P[axis],
    );
    enter = Math.max(enter, near);
    leave = Math.min(leave, far);
  }
  return enter < leave && enter > 0 ? enter : 1;
}

function ordered(a: number, b: number): [number, number] {
  return a < b ? [a, b] : [b, a];
}

function cellOf(x: number, y: number): number {
  return key(Math.floor(x / CELL_M), Math.floor(y / CELL_M));
}

function key(x: number, y: number): number {
  return 65536 * (x + 32768) + (y + 32768);
}

const DOWN = new Vector3(0, 0, -1000);
const A = new Vector3();
const E1 = new Vector3();
const E2 = new Vector3();
const P = new Vector3();
const Q = new Vector3();
const T = new Vector3();
