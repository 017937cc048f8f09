/** How much a picture may cost, chosen by how long pictures take. */

import type { Settings } from "../types";

/** What a level of quality draws. */
export interface Effort {
  /** The sun's shadows, light for each pixel, and the sky reflected. */
  rich: boolean;
  /** Pixels of the canvas per pixel of the page at most; nor ever more than the screen's own. */
  pixelRatio: number;
  /** Of the whole canvas at most, millions: where there is more page, its pixels are coarser. */
  megapixels: number;
}

/** From the best to the cheapest. */
const EFFORTS: readonly Effort[] = [
  { rich: true, pixelRatio: 2, megapixels: 8.3 },
  { rich: true, pixelRatio: 1, megapixels: 3.7 },
  { rich: false, pixelRatio: 1, megapixels: 2.1 },
  { rich: false, pixelRatio: 1, megapixels: 0.93 },
  { rich: false, pixelRatio: 1, megapixels: 0.5 },
];
const LOW = { card: 2, software: 3 };

/** Slower than this, for as many pictures as that, and the next one down is tried. */
const TOO_LONG_S = { card: 1 / 40, software: 1 / 20 };
const PICTURES = 40;

/** So many pictures after a change tell nothing: they compile. */
const SETTLING_PICTURES = 8;

/** A pause of the page, not a slow picture. */
const PAUSE_S = 0.5;

export class Quality {
  private chosen: Settings["quality"] = "auto";
  private level: number;
  private readonly best: number;
  private readonly low: number;
  private readonly tooLongS: number;
  private pictures = -SETTLING_PICTURES;
  private totalS = 0;

  /** @param software - whether pictures are drawn without a graphics card. */
  constructor(software: boolean) {
    const drawnBy = software ? "software" : "card";
    this.low = LOW[drawnBy];
    this.level = this.best = software ? this.low : 0;
    this.tooLongS = TOO_LONG_S[drawnBy];
  }

  get effort(): Effort {
    const { chosen } = this;
    const level = chosen === "auto" ? this.level : chosen === "high" ? 0 : this.low;
    return EFFORTS[level] as Effort;
  }

  /** Return how many pixels of the canvas there are per pixel of a page of some size. */
  pixelRatio(width: number, height: number, ofScreen: number): number {
    const { pixelRatio, megapixels } = this.effort;
    return Math.min(pixelRatio, ofScreen, Math.sqrt((1e6 * megapixels) / (width * height)));
  }

  choose(quality: Settings["quality"]): void {
    this.chosen = quality;
  }

  /** Try again one better, for another level: what was slow may have been something else. */
  retry(): void {
    this.move(-1);
  }

  /** Take note of how long it was from one picture to the next. */
  took(seconds: number): void {
    if (this.chosen !== "auto" || seconds > PAUSE_S) return;
    this.pictures++;
    if (this.pictures > 0) this.totalS += seconds;
    if (this.pictures < PICTURES) return;
    const slow = this.totalS / this.pictures > this.tooLongS;
    if (slow) this.move(+1);
    else this.pictures = this.totalS = 0;
  }

  private move(by: number): void {
    this.level = Math.min(Math.max(this.level + by, this.best), EFFORTS.length - 1);
    this.pictures = -SETTLING_PICTURES;
    this.totalS = 0;
  }
}
