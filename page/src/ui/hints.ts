/** Hints for who plays for the first time, on the first levels, until one of them is won. */

import type { Frame, View } from "../types";
import { make, setShown, setText } from "./dom";

const DONE = "roller.hints";
/** A ball that is so far from the start has been pushed; metres. */
const MOVED_M = 1.5;

/** One line at the bottom. */
export class Hints {
  readonly element = make("p", { class: "panel hint", role: "status", hidden: "" });
  private done = stored();

  /** Show the hint that fits what the player has and has not done yet. */
  update({ frame, hello, level, scene, seat }: View): void {
    const row = hello?.levels.find(({ name }) => name === level?.name);
    const first = hello?.mode === "play" && (row?.number === 1 || row?.name === "classic");
    const shown = !this.done && first && seat === "player" && frame?.phase === "playing";
    if (frame?.outcome === "finish" && seat === "player") this.finish();
    setShown(this.element, shown && scene !== null && !frame.agentPlays);
    if (shown && scene !== null) setText(this.element, hintFor(frame, scene.start, isHandheld()));
  }

  private finish(): void {
    if (this.done) return;
    this.done = true;
    try {
      localStorage.setItem(DONE, "done");
    } catch {
      // A browser that keeps nothing shows the hints again.
    }
  }
}

/**
 * Return the hint for a moment.
 *
 * @param frame - the moment.
 * @param start - where the ball started, metres.
 * @param touched - whether there is no keyboard.
 */
export function hintFor(frame: Frame, start: readonly number[], touched: boolean): string {
  const [x, y] = [frame.ball[0] - (start[0] ?? 0), frame.ball[1] - (start[1] ?? 0)];
  if (frame.coins === 0 && Math.hypot(x, y) < MOVED_M) {
    return touched
      ? "Put a finger down and draw it where the ball is to go"
      : "W A S D or the arrow keys push the ball";
  }
  if (frame.coins === 0) return "Roll through the coins: ten points each";
  return "Let go of the keys in time, or you fall. The finish ends the game";
}

function stored(): boolean {
  try {
    return localStorage.getItem(DONE) !== null;
  } catch {
    return false;
  }
}

function isHandheld(): boolean {
  return matchMedia("(pointer: coarse)").matches;
}
