/** Keys. Those that push go by their place: WASD is at the left of any keyboard. */

import type { Command } from "./commands";

/** Which letter of "wasd" a key holds. */
export const DIRECTION_KEYS: Readonly<Record<string, string>> = {
  KeyW: "w",
  KeyA: "a",
  KeyS: "s",
  KeyD: "d",
  ArrowUp: "w",
  ArrowLeft: "a",
  ArrowDown: "s",
  ArrowRight: "d",
};

/** Other keys go by what is printed on them. */
const COMMAND_KEYS: Readonly<Record<string, Command>> = {
  enter: "main",
  escape: "pause",
  p: "pause",
  r: "restart",
  c: "camera",
  t: "hand back",
  h: "help",
  m: "mute",
  g: "research",
  ".": "step",
  "-": "slower",
  "+": "faster",
  "=": "faster",
};

/** Where the arrows choose or seek instead of pushing. */
const ARROW_COMMANDS: Readonly<Record<string, Command>> = {
  ArrowUp: "up",
  ArrowLeft: "back",
  ArrowDown: "down",
  ArrowRight: "forward",
};

/** What the help lists: keys, and what they do. */
export const KEYS_HELP: readonly [string, string][] = [
  ["W A S D, arrows", "push the ball; two at once push diagonally"],
  ["Enter", "the button that is lit"],
  ["P, Esc", "pause and go on"],
  ["R", "restart the level"],
  ["C", "next camera"],
  ["M", "sound off and on"],
  ["G", "what an agent sees and thinks; time line"],
  ["T", "hand the ball back to the agent"],
  ["H", "this help"],
];

/** What it lists beside a time line. */
export const TIME_KEYS_HELP: readonly [string, string][] = [
  ["Space", "pause and play a replay"],
  ["← →", "a second back or on in a replay"],
  [".", "one step on, in a pause"],
  ["− +", "slower, faster"],
];

/** In what a key is pressed: where arrows push, where they seek, or where they choose. */
export type Place = "game" | "replay" | "menu";

/**
 * Return what a key asks for, null for nothing.
 *
 * @param key - what is printed on it, `KeyboardEvent.key`.
 * @param code - its place, `KeyboardEvent.code`: where no Latin letters are printed, this counts.
 * @param place - in what it is pressed.
 */
export function commandOf(key: string, code: string, place: Place): Command | null {
  if (place !== "game" && code in ARROW_COMMANDS) return ARROW_COMMANDS[code] ?? null;
  if (place === "replay" && code === "Space") return "pause";
  if (place !== "replay" && code in DIRECTION_KEYS) return null;
  const byPlace = code.replace(/^Key/, "").toLowerCase();
  return COMMAND_KEYS[key.toLowerCase()] ?? COMMAND_KEYS[byPlace] ?? null;
}
