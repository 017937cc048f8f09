import { Vector3 } from "three";

/** Where a camera is and what it looks at, metres. */
export interface Eye {
  position: Vector3;
  target: Vector3;
}

export function newEye(): Eye {
  return { position: new Vector3(), target: new Vector3(1, 0, 0) };
}

/** Return the direction in the plane that an eye looks in, radians from +x towards +y. */
export function yawOf(eye: Eye): number {
  return Math.atan2(eye.target.y - eye.position.y, eye.target.x - eye.position.x);
}

/** Return the share of a distance that is made up in a time, so that frames' lengths are of no
 * account. */
export function easing(elapsedS: number, timeConstantS: number): number {
  return 1 - Math.exp(-elapsedS / timeConstantS);
}
