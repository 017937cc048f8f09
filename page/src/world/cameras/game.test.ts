// @vitest-environment node
import { beforeEach, describe, expect, it } from "vitest";
import { fakeFrame } from "../../fakes";
import type { Frame } from "../../types";
import { newEye } from "./eye";
import { BEHIND, FIRST_PERSON, FRONT, GameCamera, OVERHEAD, RETREAT } from "./game";

const QUANT_M = 0.0254;

describe("the game's camera", () => {
  let camera: GameCamera;
  const eye = newEye();
  const look = (frame: Partial<Frame>, chosen: number | null = null, elapsedS = 0) =>
    camera.look(fakeFrame({ ball: [1, 2, 3], ...frame }), chosen, elapsedS, eye);

  beforeEach(() => {
    camera = new GameCamera();
  });

  it("is where the original's was, and looks at the ball", () => {
    const offsets = [[-100, 0, 80], null, [-10, 0, 80], [-1, 0, -80], [10, 0, 0], [80, 0, 80]];
    offsets.forEach((offset, mode) => {
      if (offset === null) return;
      look({ cameraMode: mode });
      const places = eye.position.toArray().map((place, i) => (place - (i + 1)) / QUANT_M);
      expect(places.map(Math.round)).toEqual(offset);
      if (mode !== FIRST_PERSON) expect(eye.target.toArray()).toEqual([1, 2, 3]);
    });
  });

  it("looks along +x in first person, where W pushes", () => {
    look({ cameraMode: FIRST_PERSON });
    expect(eye.target.clone().sub(eye.position).toArray()).toEqual([1, 0, 0]);
  });

  it("obeys the game until a person chooses, and again when the game changes", () => {
    look({ cameraMode: OVERHEAD });
    expect(camera.mode).toBe(OVERHEAD);
    expect(look({ cameraMode: OVERHEAD }, FRONT)).toBe(true);
    expect(camera.mode).toBe(FRONT);
    expect(look({ cameraMode: OVERHEAD }, FRONT, 5)).toBe(true);
    expect(look({ cameraMode: BEHIND }, FRONT)).toBe(false);
    expect(camera.mode).toBe(BEHIND);
  });

  it("retreats from where it is, a quant in a sixteenth of a second, to behind the ball", () => {
    look({ cameraMode: OVERHEAD });
    look({ cameraMode: RETREAT });
    const from = eye.position.x;
    expect(from).toBeCloseTo(1 - 10 * QUANT_M, 9);
    look({ cameraMode: RETREAT }, null, 1);
    expect(from - eye.position.x).toBeCloseTo(16 * QUANT_M, 9);
    for (let s = 0; s < 6; s++) look({ cameraMode: RETREAT }, null, 1);
    expect(camera.mode).toBe(BEHIND);
    expect(eye.position.x).toBeCloseTo(1 - 100 * QUANT_M, 9);
  });

  it("keeps a person's choice where the game's own retreat ends by itself", () => {
    look({ cameraMode: RETREAT });
    look({ cameraMode: RETREAT }, OVERHEAD);
    expect(look({ cameraMode: BEHIND }, OVERHEAD)).toBe(true);
    expect(camera.mode).toBe(OVERHEAD);
  });

  it("is behind the ball when a level is loaded", () => {
    look({ cameraMode: FRONT });
    camera.reset();
    expect(camera.mode).toBe(BEHIND);
  });
});
