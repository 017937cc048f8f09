/** A gamepad, in the standard layout of browsers. */

import type { Command } from "./commands";
import { type Push, stickPush } from "./directions";

const DEAD_ZONE = 0.35;
const BUTTONS: Readonly<Record<number, Command>> = {
  0: "main",
  3: "camera",
  8: "help",
  9: "pause",
};
const UP = 12;
const DOWN = 13;
const LEFT = 14;
const RIGHT = 15;
const CROSS: Readonly<Record<number, Command>> = {
  [UP]: "up",
  [DOWN]: "down",
  [LEFT]: "back",
  [RIGHT]: "forward",
};

/** What of a `Gamepad` is looked at. */
export interface Pad {
  readonly axes: readonly number[];
  readonly buttons: readonly { readonly pressed: boolean }[];
}

/** Reads a gamepad each frame. */
export class GamepadReader {
  private pressed = new Set<number>();

  /**
   * Return where the pad pushes, and what its newly pressed buttons ask for.
   *
   * @param pad - as it stands.
   * @param chooses - whether the cross chooses or seeks, instead of pushing.
   */
  read(pad: Pad, chooses: boolean): { push: Push; commands: Command[] } {
    const down = new Set<number>();
    pad.buttons.forEach((one, number) => {
      if (one.pressed) down.add(number);
    });
    const fresh = [...down].filter((number) => !this.pressed.has(number));
    this.pressed = down;
    const cross = (positive: number, negative: number): number =>
      Number(down.has(positive)) - Number(down.has(negative));
    const onCross: Push = { ahead: cross(UP, DOWN), left: cross(LEFT, RIGHT) };
    const push =
      onCross.ahead !== 0 || onCross.left !== 0
        ? onCross
        : stickPush(pad.axes[0] ?? 0, pad.axes[1] ?? 0, DEAD_ZONE);
    const commands = fresh.flatMap(
      (number) => BUTTONS[number] ?? (chooses ? CROSS[number] : null) ?? [],
    );
    return { push, commands };
  }
}
