import { expect, it } from "vitest";
import { fakeFrame, fakeRow } from "../fakes";
import type { ResultMessage } from "../types";
import { cameraName } from "./cameras";
import { rowsOf, wordOf } from "./end";
import { hintFor } from "./hints";
import { medalInReach } from "./medal";
import { newsOf } from "./messages";
import { rangeOf } from "./plot";

const RESULT: ResultMessage = {
  type: "result",
  outcome: "finish",
  coins: 9,
  coins_in_level: 12,
  score_percent: 75,
  time_s: 18.8,
  points: 90,
  medal: "silver",
  best_time: false,
  best_coins: false,
  counts: true,
  next: null,
};

it("tells of a result beside par and what was best", () => {
  const row = fakeRow({ best_time_s: 17.3, best_coins: 12 });
  expect(rowsOf(RESULT, row, 20)).toEqual([
    ["Time", "18.8 s", "par 20.0 s (−1.2 s), best 17.3 s (+1.5 s)"],
    ["Coins", "9 of 12", "best 12"],
    ["Points", "90", "75 %"],
  ]);
  const best = { ...RESULT, best_time: true, best_coins: true };
  expect(rowsOf(best, row, null).map(([, , note]) => note)).toEqual(["", "new best", "75 %"]);
});

it("says first of a result what matters most", () => {
  expect(wordOf({ ...RESULT, counts: false })).toContain("does not count");
  expect(wordOf({ ...RESULT, best_time: true })).toContain("3 left");
  expect(wordOf({ ...RESULT, coins: 12, next: "ice", best_time: true })).toContain("new best");
  expect(wordOf({ ...RESULT, outcome: "time limit" })).toBe("");
});

it("has gold in reach within par, silver after it, and nothing where there is no par", () => {
  expect([medalInReach(20, 20), medalInReach(20.1, 20)]).toEqual(["gold", "silver"]);
  expect(medalInReach(5, null)).toBeNull();
});

it("hints at the keys, then at the coins, then at the finish", () => {
  const start = [1, 0, 0];
  expect(hintFor(fakeFrame({ ball: [1.2, 0, 0] }), start, false)).toContain("W A S D");
  expect(hintFor(fakeFrame({ ball: [1.2, 0, 0] }), start, true)).toContain("finger");
  expect(hintFor(fakeFrame({ ball: [4, 0, 0] }), start, false)).toContain("coins");
  expect(hintFor(fakeFrame({ ball: [4, 0, 0], coins: 1 }), start, false)).toContain("finish");
});

it("tells screen readers of coins and ends, and of nothing else", () => {
  const frame = fakeFrame({ coins: 1 });
  expect(newsOf(frame, fakeFrame({ coins: 2 }))).toBe("2 coins");
  expect(newsOf(frame, fakeFrame({ coins: 1, outcome: "finish" }))).toBe("Finish");
  expect(newsOf(frame, fakeFrame({ coins: 1, timeS: 9 }))).toBe("");
  expect(newsOf(null, frame)).toBe("");
});

it("names the game's camera when the game decides, and else the person's", () => {
  expect(cameraName("game", 2)).toBe("overhead");
  expect(cameraName(4, 2)).toBe("first person");
  expect(cameraName("follow", 2)).toBe("follow");
});

it("scales a plot to what is in it, and a flat line to its middle", () => {
  expect(
    rangeOf([
      [1, -2],
      [3, 0.5],
    ]),
  ).toEqual([-2, 3]);
  const [low, high] = rangeOf([[5], [5]]);
  expect((low + high) / 2).toBeCloseTo(5);
  expect(low).toBeLessThan(high);
});
