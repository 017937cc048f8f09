/** Triangles of a scene's forms. */

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CylinderGeometry,
  Matrix4,
  Quaternion,
  SphereGeometry,
  Vector3,
} from "three";
import type { Quat, Scene, Shape, SurfaceData } from "../types";

/** The forms of a scene, each made once; primitives are of half edges, or radius, 1. */
export class Forms {
  private readonly made = new Map<Shape["form"], BufferGeometry>();

  constructor(private readonly scene: Scene) {}

  get(form: Shape["form"]): BufferGeometry {
    let geometry = this.made.get(form);
    if (geometry === undefined) {
      geometry = this.make(form);
      this.made.set(form, geometry);
    }
    return geometry;
  }

  dispose(): void {
    for (const geometry of this.made.values()) geometry.dispose();
  }

  private make(form: Shape["form"]): BufferGeometry {
    switch (form) {
      case "box":
        return new BoxGeometry(2, 2, 2);
      case "cylinder":
        // Of three's the axis is y, of ours z.
        return new CylinderGeometry(1, 1, 2, 40).rotateX(Math.PI / 2);
      case "sphere":
        return new SphereGeometry(1, 24, 16);
      default: {
        const data = this.scene.surfaces[form];
        if (data === undefined) throw new RangeError(`the scene has no surface ${form}`);
        return surfaceGeometry(data);
      }
    }
  }
}

/** Return where a shape is, and how large, while nothing moves. */
export function placeOf(shape: Shape): Matrix4 {
  return new Matrix4().compose(
    new Vector3(...shape.at),
    quaternionOf(shape.rotation),
    scaleOf(shape),
  );
}

export function quaternionOf([w, x, y, z]: Quat): Quaternion {
  return new Quaternion(x, y, z, w);
}

/** Return by what a shape's form is to be multiplied along each axis. */
export function scaleOf(shape: Shape): Vector3 {
  const [x = 1, y = 1, z = 1] = shape.size;
  switch (shape.form) {
    case "box":
      return new Vector3(x, y, z);
    case "cylinder":
      return new Vector3(x, x, y);
    case "sphere":
      return new Vector3(x, x, x);
    default:
      return new Vector3(1, 1, 1);
  }
}

function surfaceGeometry(data: SurfaceData): BufferGeometry {
  const geometry = new BufferGeometry();
  const floats = (text: string) => new Float32Array(bytesOf(text));
  geometry.setAttribute("position", new BufferAttribute(floats(data.vertices), 3));
  geometry.setAttribute("normal", new BufferAttribute(floats(data.normals), 3));
  geometry.setAttribute("uv", new BufferAttribute(floats(data.texture), 2));
  geometry.setIndex(new BufferAttribute(new Uint32Array(bytesOf(data.faces)), 1));
  return geometry;
}

function bytesOf(base64: string): ArrayBuffer {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
}
