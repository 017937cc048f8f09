import { expect, it } from "vitest";
import { GamepadReader, type Pad } from "./gamepad";

function pad(axes: [number, number], ...pressed: number[]): Pad {
  return {
    axes,
    buttons: Array.from({ length: 17 }, (_, i) => ({ pressed: pressed.includes(i) })),
  };
}

it("asks once for each press of a button", () => {
  const reader = new GamepadReader();
  expect(reader.read(pad([0, 0], 0, 9), false).commands).toEqual(["main", "pause"]);
  expect(reader.read(pad([0, 0], 0, 9), false).commands).toEqual([]);
  expect(reader.read(pad([0, 0]), false).commands).toEqual([]);
  expect(reader.read(pad([0, 0], 3), false).commands).toEqual(["camera"]);
});

it("pushes with the cross before the stick, and chooses with the cross where one chooses", () => {
  const reader = new GamepadReader();
  expect(reader.read(pad([1, 0]), false).push).toEqual({ ahead: -0, left: -1 });
  expect(reader.read(pad([1, 0], 12, 14), false).push).toEqual({ ahead: 1, left: 1 });
  expect(reader.read(pad([0, 0], 13), true).commands).toEqual(["down"]);
  expect(reader.read(pad([0, 0], 15), false).commands).toEqual([]);
});
