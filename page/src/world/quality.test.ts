// @vitest-environment node
import { describe, expect, it } from "vitest";
import { Quality } from "./quality";

function drawn(quality: Quality, seconds: number, pictures: number): Quality {
  for (let i = 0; i < pictures; i++) quality.took(seconds);
  return quality;
}

describe("the quality of pictures", () => {
  it("stays the best where they are quick", () => {
    const { effort } = drawn(new Quality(false), 1 / 60, 2000);
    expect(effort).toEqual({ rich: true, pixelRatio: 2 });
  });

  it("comes down step by step while they are slow: pixels first, then shadows, then pixels", () => {
    const quality = new Quality(false);
    const seen = [0, 1, 2, 3, 4, 5].map(() => {
      const { rich, pixelRatio } = quality.effort;
      drawn(quality, 1 / 20, 50);
      return `${rich} ${pixelRatio}`;
    });
    expect(seen).toEqual(["true 2", "true 1", "false 1", "false 0.75", "false 0.5", "false 0.5"]);
  });

  it("asks less of a processor that draws alone", () => {
    expect(drawn(new Quality(true), 1 / 25, 500).effort).toEqual({ rich: false, pixelRatio: 1 });
    expect(drawn(new Quality(true), 1 / 12, 50).effort.pixelRatio).toBe(0.75);
  });

  it("is tried one better for another level, but no better than the machine is", () => {
    const quality = drawn(new Quality(true), 1 / 12, 100);
    expect(quality.effort.pixelRatio).toBe(0.5);
    for (const ratio of [0.75, 1, 1]) {
      quality.retry();
      expect(quality.effort).toEqual({ rich: false, pixelRatio: ratio });
    }
  });

  it("heeds neither pauses of the page nor the pictures that compile", () => {
    const quality = drawn(new Quality(false), 30, 100);
    drawn(drawn(quality, 0.3, 8), 1 / 60, 40);
    expect(quality.effort.pixelRatio).toBe(2);
  });

  it("is what a person chooses", () => {
    const quality = new Quality(true);
    quality.choose("high");
    expect(drawn(quality, 0.2, 500).effort).toEqual({ rich: true, pixelRatio: 2 });
    quality.choose("low");
    expect(drawn(quality, 0.2, 500).effort).toEqual({ rich: false, pixelRatio: 1 });
  });
});
