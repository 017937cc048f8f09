// @vitest-environment node
import { Vector3 } from "three";
import { beforeEach, describe, expect, it } from "vitest";
import { fakeFrame, fakeScene } from "../../fakes";
import type { Shape, Vec3 } from "../../types";
import { Solids } from "../solids";
import { newEye, yawOf } from "./eye";
import { FollowCamera } from "./follow";

const DT_S = 1 / 60;

/** Return a wall of the level's material. */
function wall(at: Vec3, half: Vec3): Shape {
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
  };
}

function solidsOf(...shapes: Shape[]): Solids {
  const materials = { deck: { colour: "#808080", pattern: "plain" } } as const;
  return new Solids(fakeScene({ materials, shapes }));
}

describe("the camera that follows", () => {
  let camera: FollowCamera;
  const eye = newEye();
  const open = solidsOf();
  const go = (velocity: Vec3, seconds: number, solids = open, ball: Vec3 = [0, 0, 0]) => {
    for (let s = 0; s < seconds; s += DT_S) {
      camera.look(fakeFrame({ ball, velocity }), solids, DT_S, eye);
    }
  };

  beforeEach(() => {
    camera = new FollowCamera();
  });

  it("looks along +x at the start, from behind and above", () => {
    go([0, 0, 0], DT_S);
    expect(yawOf(eye)).toBeCloseTo(0, 6);
    expect(eye.position.x).toBeLessThan(-2);
    expect(eye.position.z).toBeGreaterThan(1);
  });

  it("turns to where the ball rolls, to either side", () => {
    for (const angle of [0.5, 1.5, -1, -1.7]) {
      camera.cut(fakeFrame());
      go([4 * Math.cos(angle), 4 * Math.sin(angle), 0], 4);
      expect(Math.cos(yawOf(eye) - angle)).toBeGreaterThan(0.99);
    }
  });

  it("does not turn to a ball that rolls towards it, but shows more of the way", () => {
    go([0, 0, 0], 1);
    const [height, distance] = [eye.position.z, eye.position.length()];
    go([-4, 0.3, 0], 5);
    expect(Math.abs(yawOf(eye))).toBeLessThan(0.1);
    expect(eye.position.z).toBeGreaterThan(height + 1);
    expect(eye.position.length()).toBeGreaterThan(distance + 1);
  });

  it("lets S be held with keys that are relative to it: the ball rolls back on one line", () => {
    const ball: [number, number, number] = [0, 0, 0];
    const velocity: [number, number, number] = [0, 0.05, 0];
    for (let s = 0; s < 4; s += DT_S) {
      camera.look(fakeFrame({ ball, velocity }), open, DT_S, eye);
      // Pushed at 3 m/s2 along the nearest of eight directions, as the keys do.
      const way = Math.round((yawOf(eye) + Math.PI) / (Math.PI / 4)) * (Math.PI / 4);
      velocity[0] += 3 * DT_S * Math.cos(way);
      velocity[1] += 3 * DT_S * Math.sin(way);
      ball[0] += DT_S * velocity[0];
      ball[1] += DT_S * velocity[1];
    }
    expect(ball[0]).toBeLessThan(-20);
    expect(Math.abs(ball[1])).toBeLessThan(1);
  });

  it("turns smoothly: never by more than five degrees from one picture to the next", () => {
    go([3, 0, 0], 1);
    let before = yawOf(eye);
    for (let i = 0; i < 240; i++) {
      go([-1, 6, 0], DT_S);
      expect(Math.cos(yawOf(eye) - before)).toBeGreaterThan(Math.cos((5 * Math.PI) / 180));
      before = yawOf(eye);
    }
  });

  it("stays as it is while the ball is slow, and turns back to +x where it rests", () => {
    go([0, 4, 0], 4);
    go([0, 0, 0], 1);
    expect(yawOf(eye)).toBeCloseTo(Math.PI / 2, 1);
    go([0, 0, 0], 8);
    expect(yawOf(eye)).toBeCloseTo(0, 1);
  });

  it("looks along the way at once where another moment is shown", () => {
    go([4, 0, 0], 1);
    camera.cut(fakeFrame({ velocity: [0, -3, 0] }));
    go([0, -3, 0], DT_S);
    expect(yawOf(eye)).toBeCloseTo(-Math.PI / 2, 1);
  });

  it("stands in a pause", () => {
    go([0, 4, 0], 0.3);
    const { x, y, z } = eye.position;
    camera.look(fakeFrame({ velocity: [0, 4, 0] }), open, 0, eye);
    expect(eye.position.toArray()).toEqual([x, y, z]);
  });

  it("looks down on where the ball will land, but not while it is thrown up", () => {
    const deck = solidsOf(wall([0, 0, -6], [20, 20, 0.5]));
    const pitch = () => Math.asin((eye.position.z - 0) / eye.position.length());
    go([1, 0, 8], 1, deck);
    expect(pitch()).toBeLessThan(0.6);
    go([1, 0, -1], 1, deck);
    expect(pitch()).toBeGreaterThan(1);
  });

  it("sees the ball in front of any wall", () => {
    // A wall behind the ball, and a low roof over it, and both.
    const behind = wall([-1.5, 0, 0], [0.1, 5, 5]);
    const roof = wall([0, 0, 1.6], [5, 5, 0.1]);
    for (const solids of [solidsOf(behind), solidsOf(roof), solidsOf(behind, roof)]) {
      camera.cut(fakeFrame());
      go([0, 0, 0], 3, solids);
      const ball = new Vector3(0, 0, 0);
      const way = eye.position.clone().sub(ball);
      expect(way.length()).toBeGreaterThan(0.8);
      expect(solids.free(ball, way)).toBe(1);
    }
  });

  it("is never behind a wall, not for one picture", () => {
    const solids = solidsOf(wall([-6, 0, 0], [0.5, 5, 5]));
    const ball = new Vector3();
    for (let x = 0; x > -5; x -= 4 * DT_S) {
      go([-4, 0, 0], DT_S, solids, [x, 0, 0]);
      ball.set(x, 0, 0);
      expect(solids.free(ball, eye.position.clone().sub(ball))).toBe(1);
    }
  });
});
