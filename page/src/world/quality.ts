/** How much a picture may cost, chosen by how long pictures take. */

import type { Settings } from "../types";

/** What a level of quality draws. */
export interface Effort {
  /** The sun's shadows, light for each pixel, and the sky reflected. */
  rich: boolean;
  /** Of the canvas per pixel of the page; at most the screen's own. */
  pixelRatio: number;
}

/** From the best to the cheapest. */
const EFFORTS: readonly Effort[] = [
  { rich: true, pixelRatio: 2 },
  { rich: true, pixelRatio: 1 },
  { rich: false, pixelRatio: 1 },
  { rich: false, pixelRatio: 0.75 },
  { rich: false, pixelRatio: 0.5 },
];
const LOW = 2;

/** Slower than this, for as many pictures as that, and the next one down is tried. */
const TOO_LONG_S = 1 / 40;
const PICTURES = 40;

/** A pause of the page, not a slow picture. */
const PAUSE_S = 0.5;

export class Quality {
  private chosen: Settings["quality"] = "auto";
  private level: number;
  private pictures = 0;
  private totalS = 0;

  /** @param software - whether pictures are drawn without a graphics card. */
  constructor(software: boolean) {
    this.level = software ? LOW : 0;
  }

  get effort(): Effort {
    const { chosen } = this;
    const level = chosen === "auto" ? this.level : chosen === "high" ? 0 : LOW;
    return EFFORTS[level] as Effort;
  }

  choose(quality: Settings["quality"]): void {
    this.chosen = quality;
  }

  /** Take note of how long it was from one picture to the next. */
  took(seconds: number): void {
    if (this.chosen !== "auto" || seconds > PAUSE_S) return;
    this.pictures++;
    this.totalS += seconds;
    if (this.pictures < PICTURES) return;
    if (this.totalS / this.pictures > TOO_LONG_S) {
      this.level = Math.min(this.level + 1, EFFORTS.length - 1);
    }
    this.pictures = this.totalS = 0;
  }
}
