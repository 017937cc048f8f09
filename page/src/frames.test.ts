// @vitest-environment node
import { describe, expect, it } from "vitest";
import { fakeFrame } from "./fakes";
import { between, FrameBuffer, goesOn, slerp } from "./frames";
import type { Frame, Quat } from "./types";

const RATE_HZ = 60;

/** Return the n-th frame of a ball that rolls along x at 3 m/s. */
function rolling(n: number, change: Partial<Frame> = {}): Frame {
  const timeS = n / RATE_HZ;
  return fakeFrame({ step: 4 * n, timeS, clockS: 100 + timeS, ball: [3 * timeS, 0, 0], ...change });
}

describe("between two frames", () => {
  it("the ball is on the line and turns on the arc", () => {
    const quarter: Quat = [Math.SQRT1_2, 0, 0, Math.SQRT1_2];
    const eighth = between(
      rolling(0),
      rolling(1, { orientation: quarter, displacements: new Float32Array([1]) }),
      0.5,
    );
    expect(eighth.ball[0]).toBeCloseTo(1.5 / RATE_HZ, 6);
    expect(eighth.orientation[0]).toBeCloseTo(Math.cos(Math.PI / 8), 6);
    expect(eighth.orientation[3]).toBeCloseTo(Math.sin(Math.PI / 8), 6);
  });

  it("what moves, the ghost and the crowd are on the line, too", () => {
    const array = (...places: number[]) => new Float32Array(places);
    const middle = between(
      rolling(0, { displacements: array(0, 2), ghost: [0, 0, 0], crowd: array(1, 1, 1) }),
      rolling(1, { displacements: array(1, 4), ghost: [2, 0, 0], crowd: array(3, 1, 1) }),
      0.5,
    );
    expect([...middle.displacements]).toEqual([0.5, 3]);
    expect(middle.ghost).toEqual([1, 0, 0]);
    expect([...(middle.crowd ?? [])]).toEqual([2, 1, 1]);
  });

  it("nothing is made up across episodes and seeks", () => {
    for (const next of [
      rolling(1, { episode: 1 }),
      rolling(1, { step: -1 }),
      rolling(1, { timeS: 2 }),
      rolling(1, { clockS: 0 }),
    ]) {
      expect(goesOn(rolling(0), next)).toBe(false);
      expect(between(rolling(0), next, 0.9)).toEqual(rolling(0));
    }
  });
});

describe("slerp", () => {
  const quaternions: Quat[] = [
    [1, 0, 0, 0],
    [0, 1, 0, 0],
    [0.5, 0.5, 0.5, 0.5],
    [-0.6, 0, 0.8, 0],
  ];

  it("keeps unit length and both ends", () => {
    for (const from of quaternions) {
      for (const to of quaternions) {
        for (const share of [0, 0.3, 0.5, 1]) {
          expect(Math.hypot(...slerp(from, to, share))).toBeCloseTo(1, 6);
        }
        const end = slerp(from, to, 1);
        const dot = end.reduce((sum, part, i) => sum + part * (to[i] as number), 0);
        expect(Math.abs(dot)).toBeCloseTo(1, 6);
      }
    }
  });

  it("takes the shorter way", () => {
    const [w] = slerp([1, 0, 0, 0], [-Math.cos(0.1), 0, 0, -Math.sin(0.1)], 0.5);
    expect(w).toBeCloseTo(Math.cos(0.05), 6);
  });
});

describe("the buffer", () => {
  it("moves the ball evenly though frames come unevenly", () => {
    const buffer = new FrameBuffer();
    const lateBy = [0, 0.006, -0.004, 0.009, 0.002, -0.003];
    const arrivals = Array.from({ length: 120 }, (_, n) => ({
      atS: n / RATE_HZ + (lateBy[n % lateBy.length] ?? 0),
      frame: rolling(n),
    })).sort((a, b) => a.atS - b.atS);
    const seen: number[] = [];
    let next = 0;
    for (let nowS = 0; nowS < 2; nowS += 1 / 144) {
      for (; (arrivals[next]?.atS ?? Infinity) <= nowS; next++) {
        buffer.push((arrivals[next] as { frame: Frame }).frame);
      }
      const ball = buffer.sample(nowS)?.ball[0];
      if (ball !== undefined && nowS > 0.5 && nowS < 1.9) seen.push(ball);
    }
    const steps = seen.slice(1).map((place, i) => (place - (seen[i] as number)) * (144 / 3));
    expect(Math.min(...steps)).toBeGreaterThan(0.7);
    expect(Math.max(...steps)).toBeLessThan(1.3);
  });

  it("is a frame and a half behind the newest", () => {
    const buffer = new FrameBuffer();
    let drawn: Frame | null = null;
    for (let n = 0; n < 120; n++) {
      buffer.push(rolling(n));
      drawn = buffer.sample(n / RATE_HZ);
    }
    expect((rolling(119).clockS - (drawn?.clockS ?? 0)) * RATE_HZ).toBeCloseTo(1.5, 1);
  });

  it("shows a new episode and a sought moment at once", () => {
    for (const there of [rolling(0, { episode: 1 }), rolling(200)]) {
      const buffer = new FrameBuffer();
      for (let n = 0; n < 30; n++) {
        buffer.push(rolling(n));
        buffer.sample(n / RATE_HZ);
      }
      buffer.push(there);
      expect(buffer.sample(0.5)).toEqual(there);
    }
  });

  it("shows the newest state where time stands still, as in a pause and a single step", () => {
    const buffer = new FrameBuffer();
    for (let n = 0; n < 30; n++) buffer.push(rolling(n));
    buffer.push(rolling(29, { phase: "paused" }));
    expect(buffer.sample(0.5)).toMatchObject({ phase: "paused", ball: rolling(29).ball });
  });

  it("never runs ahead of what came, and waits there without going back", () => {
    const buffer = new FrameBuffer();
    for (let n = 0; n < 10; n++) {
      buffer.push(rolling(n));
      buffer.sample(n / RATE_HZ);
    }
    for (const nowS of [0.18, 0.2, 0.5, 5]) buffer.sample(nowS);
    expect(buffer.sample(6)?.ball).toEqual(rolling(9).ball);
  });

  it("is slow where time is", () => {
    const buffer = new FrameBuffer();
    const slow = (n: number) => rolling(n / 4, { step: n, speed: 0.25 });
    const places: number[] = [];
    for (let n = 0; n < 120; n++) {
      buffer.push(slow(n));
      places.push(buffer.sample(n / RATE_HZ)?.ball[0] ?? 0);
    }
    const perFrame = ((places[119] as number) - (places[59] as number)) / 60;
    expect(perFrame).toBeCloseTo((0.25 * 3) / RATE_HZ, 4);
  });

  it("is empty until a frame comes, and after it is cleared", () => {
    const buffer = new FrameBuffer();
    expect(buffer.sample(1)).toBeNull();
    buffer.push(rolling(0));
    buffer.clear();
    expect(buffer.sample(2)).toBeNull();
  });
});
