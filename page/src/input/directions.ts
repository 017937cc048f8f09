/** Directions: the eight that four keys can push into, and how others come to them. */

/** Letters of held keys along the axes of the world: W is +x, A is +y. */
export type Held = string;

/** By eighths of a turn to the left of +x. */
const OCTANTS: readonly Held[] = ["w", "wa", "a", "as", "s", "sd", "d", "wd"];

/** How far beyond its edge an octant is held on to, so that it does not flicker; radians. */
const HYSTERESIS = (7 / 180) * Math.PI;

/** A push as somebody at the screen means it: away from them, and to their left. */
export interface Push {
  ahead: number;
  left: number;
}

/** Return the push of held keys; opposite ones cancel each other. */
export function pushOf(held: Held): Push {
  const one = (letter: string): number => (held.includes(letter) ? 1 : 0);
  return { ahead: one("w") - one("s"), left: one("a") - one("d") };
}

/**
 * Return the keys whose push is nearest to a push, "" for none.
 *
 * @param push - what is meant, beside the camera.
 * @param yaw - of the camera: angle from +x to its sight, to the left, radians; 0 to push along the
 * axes of the world.
 * @param before - what was returned for the moment before.
 */
export function heldFor(push: Push, yaw: number, before: Held = ""): Held {
  if (push.ahead === 0 && push.left === 0) return "";
  const angle = Math.atan2(push.left, push.ahead) + yaw;
  const kept = OCTANTS.indexOf(before);
  const eighth = Math.PI / 4;
  if (kept >= 0 && Math.abs(turn(angle - kept * eighth)) < eighth / 2 + HYSTERESIS) return before;
  const octant = ((Math.round(angle / eighth) % 8) + 8) % 8;
  return OCTANTS[octant] ?? "";
}

/** Return an angle between -pi and pi. */
function turn(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/**
 * Return the push of a stick, of none within its dead zone.
 *
 * @param x - to the right, -1 to 1.
 * @param y - downwards, -1 to 1.
 * @param dead - radius of the dead zone.
 */
export function stickPush(x: number, y: number, dead: number): Push {
  return Math.hypot(x, y) < dead ? { ahead: 0, left: 0 } : { ahead: -y, left: -x };
}
