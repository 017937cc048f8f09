/** A flare where each coin was, from when it is taken: it grows and fades, as the original's. */

import type { Frame, Vec3 } from "../types";
import { isTaken } from "../wire";
import type { Glows } from "./glow";

const METRES_PER_QUANT = 0.0254;

/** `EXPLOFLARE2` of the original: its width grows by 48 quants a second, its alpha falls from 100
 * by 32 a second. */
const RADIUS_GROWTH_M_S = (48 * METRES_PER_QUANT) / 2;
const LIFE_S = 100 / 32;

/** Where the original's alpha is 100: the ball is to be seen through a flare. */
const OPACITY = 0.5;

/** More than that at once put out the oldest. */
export const MAX_FLARES = 64;

interface Flare {
  at: Vec3;
  bornS: number;
  colour: readonly [number, number, number];
}

export class Flares {
  private burning: Flare[] = [];
  private before: Frame | null = null;

  /** @param coins - where each is. */
  constructor(private readonly coins: ReadonlyMap<number, Vec3>) {}

  /** Light flares for the coins taken since the last call, and add what burns to the lights. */
  show(frame: Frame, glows: Glows): void {
    const { before } = this;
    this.before = frame;
    if (before && (before.episode !== frame.episode || before.clockS > frame.clockS)) {
      this.burning = [];
    } else if (before) {
      for (const [coin, at] of this.coins) {
        if (isTaken(frame, coin) && !isTaken(before, coin)) this.light(at, frame.clockS);
      }
    }
    this.burning = this.burning.filter(({ bornS }) => frame.clockS - bornS < LIFE_S);
    for (const { at, bornS, colour } of this.burning) {
      const age = frame.clockS - bornS;
      glows.add(...at, RADIUS_GROWTH_M_S * age, colour, OPACITY * (1 - age / LIFE_S));
    }
  }

  private light(at: Vec3, bornS: number): void {
    // Not black: a light has at least one strong colour.
    const parts = [0, 1, 2].map(() => 0.2 + 0.8 * Math.random());
    const [red = 1, green = 1, blue = 1] = parts.map((part) => part / Math.max(...parts));
    this.burning.push({ at, bornS, colour: [red, green, blue] });
    if (this.burning.length > MAX_FLARES) this.burning.shift();
  }
}
