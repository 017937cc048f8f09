import { describe, expect, it } from "vitest";
import { heldFor, pushOf, stickPush } from "./directions";

const EIGHTH = Math.PI / 4;
const OCTANTS = ["w", "wa", "a", "as", "s", "sd", "d", "wd"];

describe("a push", () => {
  it("holds the keys that are pressed when they go along the world", () => {
    for (const held of OCTANTS) expect(heldFor(pushOf(held), 0)).toBe(held);
  });

  it("turns with the camera", () => {
    OCTANTS.forEach((held, octant) => {
      for (let turn = -16; turn <= 16; turn++) {
        const turned = OCTANTS[(((octant + turn) % 8) + 8) % 8];
        expect(heldFor(pushOf(held), turn * EIGHTH)).toBe(turned);
      }
    });
  });

  it("is nothing where opposite keys are held", () => {
    expect(heldFor(pushOf("ws"), 0)).toBe("");
    expect(heldFor(pushOf("ad"), 1)).toBe("");
    expect(heldFor(pushOf("wasd"), 1)).toBe("");
    expect(heldFor(pushOf("wad"), 0)).toBe("w");
  });

  it("is never more than half an eighth off what is meant", () => {
    for (let angle = -7; angle < 7; angle += 0.013) {
      const { ahead, left } = pushOf(heldFor({ ahead: Math.cos(angle), left: Math.sin(angle) }, 0));
      const off = Math.atan2(left, ahead) - angle;
      expect(Math.abs(Math.atan2(Math.sin(off), Math.cos(off)))).toBeLessThan(EIGHTH / 2 + 1e-9);
    }
  });

  it("does not flicker where two eighths meet", () => {
    const ahead = pushOf("w");
    expect(heldFor(ahead, EIGHTH / 2 + 0.05, "w")).toBe("w");
    expect(heldFor(ahead, EIGHTH / 2 + 0.05, "wa")).toBe("wa");
    expect(heldFor(ahead, EIGHTH / 2 + 0.2, "w")).toBe("wa");
    expect(heldFor(ahead, 2 * Math.PI + EIGHTH / 2 + 0.05, "w")).toBe("w");
  });
});

describe("a stick", () => {
  it("pushes away from the person when it is pushed up", () => {
    expect(heldFor(stickPush(0, -1, 0.3), 0)).toBe("w");
    expect(heldFor(stickPush(1, 0, 0.3), 0)).toBe("d");
    expect(heldFor(stickPush(-0.7, 0.7, 0.3), 0)).toBe("as");
  });

  it("pushes nothing near its middle", () => {
    expect(heldFor(stickPush(0.2, -0.1, 0.3), 0)).toBe("");
  });
});
