import { expect, it } from "vitest";
import { fakeFrame, fakeScene } from "./fakes";
import { soundEvents } from "./sound";
import type { Frame } from "./types";

const SCENE = fakeScene({
  machines: ["plate", "gate", "lift_pad", "switch", "fan"].map((kind) => ({ kind, name: "" })),
});

function heard(before: Partial<Frame>, after: Partial<Frame>): string[] {
  const phases = new Uint8Array(SCENE.machines.length);
  const one = fakeFrame({ step: 1, phases, ...before });
  const other = fakeFrame({ step: 5, timeS: 1 / 60, phases, ...after });
  return soundEvents(one, other, SCENE).map(({ sound }) => sound);
}

it("hears nothing of the first frame, nor of a ball that rolls", () => {
  expect(soundEvents(null, fakeFrame({ coins: 3 }), SCENE)).toEqual([]);
  expect(heard({ velocity: [3, 0, 0] }, { velocity: [3.2, 0.1, -0.16] })).toEqual([]);
});

it("hears a coin, two at once as one", () => {
  expect(heard({ coins: 1 }, { coins: 2 })).toEqual(["coin"]);
  expect(heard({ coins: 1 }, { coins: 3 })).toEqual(["coin"]);
});

it("hears machines begin, not go on or end", () => {
  expect(heard({}, { phases: Uint8Array.of(1, 1, 1, 1, 1) })).toEqual(["plate", "gate", "pad"]);
  const active = Uint8Array.of(1, 1, 0, 1, 1);
  expect(heard({ phases: active }, { phases: active })).toEqual([]);
  expect(heard({ phases: active }, { phases: Uint8Array.of(2, 2, 0, 0, 0) })).toEqual([]);
});

it("hears a landing the louder the harder it is", () => {
  const gains = [3, 5, 8, 30].map((speed) => {
    const [event] = soundEvents(
      fakeFrame({ step: 1, velocity: [0, 0, -speed], phases: new Uint8Array(5) }),
      fakeFrame({ step: 5, timeS: 1 / 60, velocity: [0, 0, 0], phases: new Uint8Array(5) }),
      SCENE,
    );
    expect(event?.sound).toBe("landing");
    return event?.gain ?? 0;
  });
  expect(gains).toEqual([...gains].sort((one, other) => one - other));
  expect(gains[0]).toBeGreaterThan(0);
  expect(gains.at(-1)).toBe(1);
});

it("hears no landing while a pad throws the ball, nor when a door takes it elsewhere", () => {
  const still = { velocity: [0, 0, 0] } as const;
  expect(heard(still, { velocity: [0, 0, 9], phases: Uint8Array.of(0, 0, 1, 0, 0) })).toEqual([
    "pad",
  ]);
  expect(heard(still, { velocity: [0, 0, 9], ball: [20, 0, 0] })).toEqual([]);
});

it("hears the finish once, and a fall though another episode begins with it", () => {
  expect(heard({}, { outcome: "finish" })).toEqual(["finish"]);
  expect(heard({ outcome: "finish" }, { outcome: "finish" })).toEqual([]);
  expect(heard({ coins: 0 }, { falls: 1, episode: 1, step: 0 })).toEqual(["fall"]);
});

it("hears nothing where time was wound back or an episode begins anew", () => {
  expect(heard({ step: 90, velocity: [0, 0, 9] }, { step: 5 })).toEqual([]);
  expect(heard({ coins: 0 }, { episode: 1, coins: 3 })).toEqual([]);
});
