/** What cameras are called. */

import type { Settings } from "../types";

/** Of the game's modes, by number. */
export const CAMERA_NAMES = [
  "behind",
  "gliding back",
  "overhead",
  "below",
  "first person",
  "in front",
];

/**
 * Return what a camera is called.
 *
 * @param camera - as it is set.
 * @param asked - mode that the game asks for.
 */
export function cameraName(camera: Settings["camera"], asked: number): string {
  const mode = camera === "game" ? asked : camera;
  return typeof mode === "number" ? (CAMERA_NAMES[mode] ?? "") : mode;
}
