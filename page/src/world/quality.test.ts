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
    expect(effort).toMatchObject({ rich: true, pixelRatio: 2 });
  });

  it("comes down step by step while they are slow: pixels first, then shadows, then pixels", () => {
    const quality = new Quality(false);
    const seen = [0, 1, 2, 3, 4, 5].map(() => {
      const { rich } = quality.effort;
      const width = Math.round(1920 * quality.pixelRatio(1920, 1080, 2));
      drawn(quality, 1 / 20, 50);
      return `${rich} ${width}`;
    });
    expect(seen).toEqual([
      "true 3840",
      "true 1920",
      "false 1920",
      "false 1286",
      "false 943",
      "false 943",
    ]);
  });

  it("asks less of a processor that draws alone", () => {
    const quick = drawn(new Quality(true), 1 / 25, 500);
    expect(quick.effort.rich).toBe(false);
    expect(quick.pixelRatio(1280, 720, 1)).toBe(1);
    expect(drawn(new Quality(true), 1 / 12, 50).pixelRatio(1280, 720, 1)).toBeLessThan(0.75);
  });

  it("never draws more pixels than a page or a screen shows, nor too many on a large one", () => {
    const quality = new Quality(true);
    expect(quality.pixelRatio(360, 640, 1)).toBe(1);
    expect(quality.pixelRatio(360, 640, 3)).toBe(1);
    expect(3840 * quality.pixelRatio(3840, 2160, 1)).toBeLessThan(1300);
    expect(new Quality(false).pixelRatio(360, 640, 1.5)).toBe(1.5);
  });

  it("is tried one better for another level, but no better than the machine is", () => {
    const quality = drawn(new Quality(true), 1 / 12, 100);
    const { effort } = quality;
    quality.retry();
    expect(quality.effort.megapixels).toBeGreaterThan(effort.megapixels);
    for (let i = 0; i < 5; i++) quality.retry();
    expect(quality.effort).toEqual(new Quality(true).effort);
  });

  it("heeds neither pauses of the page nor the pictures that compile", () => {
    const quality = drawn(new Quality(false), 30, 100);
    drawn(drawn(quality, 0.3, 8), 1 / 60, 40);
    expect(quality.effort.pixelRatio).toBe(2);
  });

  it("is what a person chooses", () => {
    const quality = new Quality(true);
    quality.choose("high");
    expect(drawn(quality, 0.2, 500).effort.rich).toBe(true);
    quality.choose("low");
    expect(drawn(quality, 0.2, 500).effort).toEqual(new Quality(true).effort);
  });
});
