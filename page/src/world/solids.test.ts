// @vitest-environment node
import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { fakeFrame, fakeScene } from "../fakes";
import type { Shape, Vec3 } from "../types";
import { Solids } from "./solids";

function box(at: Vec3, half: Vec3, change: Partial<Shape> = {}): Shape {
  return {
    form: "box",
    size: half,
    at,
    rotation: [1, 0, 0, 0],
    look: ["deck"],
    is_material: true,
    mover: -1,
    machine: -1,
    coin: -1,
    seen_in: [0, 1, 2],
    motion: null,
    ...change,
  };
}

const TILT = 0.4;
const tilted = box([20, 0, 0], [3, 3, 0.5], {
  rotation: [Math.cos(TILT / 2), 0, Math.sin(TILT / 2), 0],
});
const lift = box([0, 20, 0], [1, 1, 0.25], { look: ["metal/"], is_material: false, mover: 0 });
const glass = box([0, -20, 2], [1, 1, 1], { look: ["glass"] });
const scene = fakeScene({
  materials: {
    deck: { colour: "#808080", pattern: "plain" },
    glass: { colour: "#ffffff80", pattern: "plain" },
  },
  movers: [{ name: "lift", along: [0, 0, 1] }],
  shapes: [box([0, 0, -0.5], [5, 5, 0.5]), box([0, 0, 3], [5, 5, 0.25]), tilted, lift, glass],
});

describe("the ground below a point", () => {
  const solids = new Solids(scene);
  const below = (x: number, y: number, z: number) => solids.below(new Vector3(x, y, z));

  it("is the next one down, not the roof above nor what is under it", () => {
    expect(below(0.3, 0.7, 1)?.height).toBeCloseTo(0, 6);
    expect(below(0.3, 0.7, 10)?.height).toBeCloseTo(3.25, 6);
  });

  it("is none beside everything", () => {
    expect(below(5.1, 0, 1)).toBeNull();
    expect(below(300, -70, 1)).toBeNull();
  });

  it("slopes where a ramp does", () => {
    const ground = below(20, 0, 5);
    expect(ground?.height).toBeCloseTo(0.5 / Math.cos(TILT), 6);
    expect(ground?.normal.z).toBeCloseTo(Math.cos(TILT), 6);
  });

  it("is what moves, too, wherever it is just then", () => {
    expect(below(0, 20, 5)?.height).toBeCloseTo(0.25, 3);
    solids.show(fakeFrame({ displacements: new Float32Array([2]) }));
    expect(below(0, 20, 5)?.height).toBeCloseTo(2.25, 3);
    expect(below(0, 20, 1)).toBeNull();
  });
});

describe("the free share of a way", () => {
  const solids = new Solids(scene);
  const free = (from: Vec3, way: Vec3) => solids.free(new Vector3(...from), new Vector3(...way));

  it("ends at what is hit first", () => {
    expect(free([0.1, 0.2, 1], [0, 0, 4])).toBeCloseTo(1.75 / 4, 6);
    expect(free([-10, 0.3, -0.5], [100, 0, 0])).toBeCloseTo(0.05, 6);
    expect(free([0, 20, 3], [0, 0, -5])).toBeCloseTo(2.75 / 5, 6);
  });

  it("is all of it past everything, and through glass", () => {
    expect(free([0, 0, 1], [4, 3, 0.5])).toBe(1);
    expect(free([0, -15, 2.2], [0, -10, 0])).toBe(1);
  });
});
