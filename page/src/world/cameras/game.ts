/** The six cameras of the original, of which the game asks for one and a person may choose one. */

import type { Frame } from "../../types";
import type { Eye } from "./eye";

export const BEHIND = 0;
export const RETREAT = 1;
export const OVERHEAD = 2;
export const BELOW = 3;
export const FIRST_PERSON = 4;
export const FRONT = 5;

/** In which a person goes through the modes. The retreat comes last: it glides from the front to
 * behind the ball, where the first mode is; from there it would have nowhere to glide. */
export const ORDER: readonly number[] = [BEHIND, OVERHEAD, BELOW, FIRST_PERSON, FRONT, RETREAT];

const METRES_PER_QUANT = 0.0254;

/** Camera minus ball in each mode, quants (`camera1` of the original). */
const OFFSETS: readonly (readonly [number, number, number])[] = [
  [-100, 0, 80],
  [-100, 0, 80], // where the retreat ends; its x is kept by the camera
  [-10, 0, 80],
  [-1, 0, -80],
  [10, 0, 0],
  [80, 0, 80],
];

/** Speed of the retreat: one quant in a tick of 1/16 s. */
const RETREAT_M_S = 16 * METRES_PER_QUANT;

/** How far ahead one looks in first person, where W pushes: along +x, metres. */
const FIRST_PERSON_LOOKS_M = 1;

export class GameCamera {
  /** The mode in force, 0 to 5. */
  mode = BEHIND;
  private asked = BEHIND;
  private chosen: number | null = null;
  private x = 0;

  /** Go back behind the ball, as when the level is loaded. */
  reset(): void {
    this.mode = this.asked = BEHIND;
    this.chosen = null;
  }

  /**
   * Move on for a time.
   *
   * A person's choice lasts until the game itself changes the mode.
   *
   * @param frame - as drawn.
   * @param chosen - the mode that a person has chosen, or null to have the game's.
   * @returns whether the choice still holds.
   */
  look(frame: Frame, chosen: number | null, elapsedS: number, eye: Eye): boolean {
    if (chosen !== this.chosen) {
      this.chosen = chosen;
      this.enter(chosen ?? frame.cameraMode, frame);
    }
    if (frame.cameraMode !== this.asked) {
      const endsByItself = this.asked === RETREAT && frame.cameraMode === BEHIND;
      this.asked = frame.cameraMode;
      if (!endsByItself) {
        this.chosen = null;
        this.enter(this.asked, frame);
      }
    }
    const [ballX, ballY, ballZ] = frame.ball;
    if (this.mode === RETREAT) {
      this.x -= RETREAT_M_S * elapsedS;
      if (this.x <= ballX + offsetOf(BEHIND)[0]) this.mode = BEHIND;
    }
    const [x, y, z] = offsetOf(this.mode);
    eye.position.set(this.mode === RETREAT ? this.x : ballX + x, ballY + y, ballZ + z);
    const ahead = this.mode === FIRST_PERSON ? x + FIRST_PERSON_LOOKS_M : 0;
    eye.target.set(ballX + ahead, ballY, ballZ);
    return this.chosen === chosen;
  }

  /** Change the mode; a retreat begins where the camera is. */
  private enter(mode: number, frame: Frame): void {
    if (mode === RETREAT && this.mode !== RETREAT) this.x = frame.ball[0] + offsetOf(this.mode)[0];
    this.mode = mode;
  }
}

function offsetOf(mode: number): [number, number, number] {
  const [x, y, z] = OFFSETS[mode] ?? [0, 0, 0];
  return [x * METRES_PER_QUANT, y * METRES_PER_QUANT, z * METRES_PER_QUANT];
}
