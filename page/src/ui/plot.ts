/** A small live plot: the last seconds of some numbers, as lines. */

import { make } from "./dom";

const WIDTH = 100;
const HEIGHT = 26;
/** Values kept of each number: about nine seconds at ten a second. */
const KEPT = 90;
/** Told apart by lightness as well as by hue. */
const COLOURS = ["#ffcc38", "#7cc4ff", "#ff8f7a", "#b6f09c", "#d7b3ff", "#ffffff"];

/** Lines on a canvas, scaled to what is in sight. */
export class Plot {
  readonly canvas = make("canvas", { class: "plot", "aria-hidden": "true" });
  private readonly values: (readonly number[])[] = [];

  constructor() {
    const ratio = Math.min(globalThis.devicePixelRatio ?? 1, 2);
    this.canvas.width = WIDTH * ratio;
    this.canvas.height = HEIGHT * ratio;
  }

  /** Add the numbers of a moment. */
  push(values: readonly number[]): void {
    if (this.values[0] && this.values[0].length !== values.length) this.values.length = 0;
    this.values.push(values);
    if (this.values.length > KEPT) this.values.shift();
    this.draw();
  }

  private draw(): void {
    const context = this.canvas.getContext("2d");
    if (context === null) return;
    const { width, height } = this.canvas;
    const [low, high] = rangeOf(this.values);
    context.clearRect(0, 0, width, height);
    context.lineWidth = Math.max(1, height / HEIGHT) * 1.4;
    const count = this.values[0]?.length ?? 0;
    for (let number = 0; number < count; number++) {
      context.strokeStyle = COLOURS[number % COLOURS.length] ?? "#ffffff";
      context.beginPath();
      this.values.forEach((moment, i) => {
        const x = (i / (KEPT - 1)) * width;
        const y = height * (0.92 - (0.84 * ((moment[number] ?? 0) - low)) / (high - low));
        if (i === 0) context.moveTo(x, y);
        else context.lineTo(x, y);
      });
      context.stroke();
    }
  }
}

/** Return the least and the largest number, a little apart if there is only one. */
export function rangeOf(moments: readonly (readonly number[])[]): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (const moment of moments) {
    for (const value of moment) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  if (!(low <= high)) return [0, 1];
  const least = 1e-6 + 0.01 * Math.max(Math.abs(low), Math.abs(high));
  return high - low < least ? [low - least, high + least] : [low, high];
}
