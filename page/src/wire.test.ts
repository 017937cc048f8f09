// @vitest-environment node
import { describe, expect, it } from "vitest";
import { decodeFrame, decodeMessage, encodeMessage, isTaken } from "./wire";

const GHOST = 8;

/** Return a frame's bytes, written by hand from the layout that the server documents. */
function frameBytes({ flags = 0, coins = 10, crowd = [] as number[][] } = {}): ArrayBuffer {
  const [movers, machines] = [2, 3];
  const length = 98 + 4 * movers + machines + Math.ceil(coins / 8);
  const view = new DataView(new ArrayBuffer(length + (crowd.length ? 2 + 6 * crowd.length : 0)));
  for (const [at, value] of [
    [0, 1],
    [1, 2],
    [2, flags],
    [3, 4],
    [30, 1 + 8],
    [31, 0],
    [94, movers],
    [96, machines],
  ] as const) {
    view.setUint8(at, value);
  }
  view.setUint32(4, 7, true);
  view.setUint32(8, 70_000, true);
  view.setFloat64(16, 123.456, true);
  view.setUint16(28, 5, true);
  const floats = (at: number, values: number[]) =>
    values.forEach((value, i) => {
      view.setFloat32(at + 4 * i, value, true);
    });
  floats(12, [2.5]);
  floats(24, [0.25]);
  floats(32, [1, 2, 3]);
  floats(44, [1, 0, 0, 0]);
  floats(60, [-1, 0, 0.5]);
  floats(72, [50, 0.25, 4, 5, 6]);
  view.setUint16(92, 3, true);
  floats(98, [0.5, -0.25]);
  [0, 1, 2].forEach((phase, i) => {
    view.setUint8(98 + 4 * movers + i, phase);
  });
  view.setUint8(98 + 4 * movers + machines + 1, 0b10);
  crowd.flat().forEach((place, i) => {
    view.setUint16(length, crowd.length, true);
    view.setInt16(length + 2 + 2 * i, place, true);
  });
  return view.buffer;
}

describe("a frame", () => {
  it("says all that the server wrote", () => {
    const frame = decodeFrame(frameBytes(), 10);
    expect(frame).toMatchObject({
      phase: "playing",
      cameraMode: 4,
      episode: 7,
      step: 70_000,
      timeS: 2.5,
      clockS: 123.456,
      keysInS: 0.25,
      coins: 5,
      keys: "wd",
      outcome: "none",
      ball: [1, 2, 3],
      orientation: [1, 0, 0, 0],
      velocity: [-1, 0, 0.5],
      totalReward: 50,
      speed: 0.25,
      ghost: null,
      falls: 3,
      crowd: null,
      hasAgent: false,
    });
    expect([...frame.displacements]).toEqual([0.5, -0.25]);
    expect([...frame.phases]).toEqual([0, 1, 2]);
    expect([...Array(10).keys()].filter((coin) => isTaken(frame, coin))).toEqual([9]);
  });

  it("has a ghost only where its flag says so", () => {
    expect(decodeFrame(frameBytes({ flags: GHOST }), 10).ghost).toEqual([4, 5, 6]);
  });

  it("may end in a crowd, in hundredths of metres", () => {
    const { crowd } = decodeFrame(
      frameBytes({
        crowd: [
          [100, -250, 3],
          [0, 1, 32767],
        ],
      }),
      10,
    );
    expect([...(crowd ?? [])].map((place) => place.toFixed(2))).toEqual([
      "1.00",
      "-2.50",
      "0.03",
      "0.00",
      "0.01",
      "327.67",
    ]);
  });

  it("is refused where its length is not what it says", () => {
    const whole = frameBytes({ crowd: [[1, 2, 3]] });
    for (const end of [0, 50, 95, 100, whole.byteLength - 1]) {
      expect(() => decodeFrame(whole.slice(0, end), 10), `${end} bytes`).toThrow(RangeError);
    }
    expect(() => decodeFrame(frameBytes(), 30)).toThrow(RangeError);
  });

  it("is refused in another format", () => {
    const other = new Uint8Array(frameBytes());
    other[0] = 2;
    expect(() => decodeFrame(other, 10)).toThrow(/format 1/);
  });

  it("may lie anywhere in a longer run of bytes, as in a replay", () => {
    const bytes = new Uint8Array(frameBytes());
    const run = new Uint8Array([...bytes, ...bytes]);
    const second = decodeFrame(run.subarray(bytes.length), 10);
    expect(second).toEqual(decodeFrame(bytes, 10));
  });
});

describe("a message", () => {
  it("goes out as the server reads it", () => {
    expect(encodeMessage({ type: "seek", time_s: 1.5 })).toBe('{"type":"seek","time_s":1.5}');
  });

  it("that has no type is none", () => {
    expect(decodeMessage("[1]")).toBeNull();
    expect(decodeMessage('{"type":"notice","text":"hi"}')).toEqual({ type: "notice", text: "hi" });
  });
});
