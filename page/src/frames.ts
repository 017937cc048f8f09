/** What is drawn between the frames that came: positions by line, orientations by slerp. */

import type { Frame, Quat, Vec3 } from "./types";

/** How far behind the newest frame the picture is, in frames: enough for one that comes late. */
const DELAY_FRAMES = 1.5;
const MAX_DELAY_S = 0.15;

/** Frames kept: those that the delay can reach, and one more. */
const KEPT = 4;

/** Time in which the playhead makes up for what it is ahead or behind. */
const CATCH_UP_S = 0.25;

/** Further behind than this it jumps instead. */
const MAX_ERROR_S = 0.25;

/** A step further than this is a seek. */
const SEEK_S = 1.0;

/** Return whether a frame goes on from the one before: there is no new episode and no seek. */
export function goesOn(before: Frame, frame: Frame): boolean {
  return (
    frame.episode === before.episode &&
    frame.step >= before.step &&
    frame.clockS >= before.clockS &&
    frame.timeS - before.timeS <= SEEK_S
  );
}

/** Return the frame at a share, 0 to 1, of the way from one to the next that goes on from it. */
export function between(before: Frame, after: Frame, share: number): Frame {
  if (share <= 0 || !goesOn(before, after)) return before;
  if (share >= 1) return after;
  return {
    ...before,
    timeS: mix(before.timeS, after.timeS, share),
    clockS: mix(before.clockS, after.clockS, share),
    ball: mixVector(before.ball, after.ball, share),
    orientation: slerp(before.orientation, after.orientation, share),
    velocity: mixVector(before.velocity, after.velocity, share),
    ghost: before.ghost && after.ghost ? mixVector(before.ghost, after.ghost, share) : after.ghost,
    displacements: mixArray(before.displacements, after.displacements, share),
    crowd:
      before.crowd && after.crowd?.length === before.crowd.length
        ? mixArray(before.crowd, after.crowd, share)
        : after.crowd,
  };
}

/** Frames as they come, played a little later so that there is one on either side. */
export class FrameBuffer {
  private frames: Frame[] = [];
  private playhead = 0;
  private sampledAt = 0;

  get newest(): Frame | null {
    return this.frames.at(-1) ?? null;
  }

  clear(): void {
    this.frames = [];
  }

  push(frame: Frame): void {
    const last = this.newest;
    // Where time stands still there is nothing between, and the newest state is to be seen.
    if (last === null || !goesOn(last, frame) || frame.clockS === last.clockS) {
      this.frames = [frame];
      this.playhead = frame.clockS;
      return;
    }
    this.frames.push(frame);
    if (this.frames.length > KEPT) this.frames.shift();
  }

  /** Return the frame to draw at a time of the page's clock, or null before the first one came. */
  sample(nowS: number): Frame | null {
    const newest = this.newest;
    if (newest === null) return null;
    this.advance(newest, Math.max(nowS - this.sampledAt, 0));
    this.sampledAt = nowS;
    let before = this.frames[0] ?? newest;
    for (const after of this.frames) {
      if (after.clockS > this.playhead) {
        const length = after.clockS - before.clockS;
        return length > 0
          ? between(before, after, (this.playhead - before.clockS) / length)
          : after;
      }
      before = after;
    }
    return before;
  }

  private advance(newest: Frame, elapsedS: number): void {
    const oldest = this.frames[0] ?? newest;
    const interval = (newest.clockS - oldest.clockS) / Math.max(this.frames.length - 1, 1);
    const target = newest.clockS - Math.min(DELAY_FRAMES * interval, MAX_DELAY_S);
    const ahead = this.playhead + elapsedS * newest.speed;
    const error = target - ahead;
    const share = error > MAX_ERROR_S ? 1 : Math.min(elapsedS / CATCH_UP_S, 1);
    // Waiting for a frame that is late, time may stand still, but never runs back.
    this.playhead = Math.max(this.playhead, ahead + share * error);
    this.playhead = Math.min(this.playhead, newest.clockS);
  }
}

/** Return the rotation at a share of the shorter way from one unit quaternion to another. */
export function slerp(from: Quat, to: Quat, share: number): Quat {
  const dot = from[0] * to[0] + from[1] * to[1] + from[2] * to[2] + from[3] * to[3];
  const sign = dot < 0 ? -1 : 1;
  const angle = Math.acos(Math.min(Math.abs(dot), 1));
  // Where they nearly agree, the sines vanish and the line is the arc.
  const sine = Math.sin(angle);
  const first = sine > 1e-4 ? Math.sin((1 - share) * angle) / sine : 1 - share;
  const second = sign * (sine > 1e-4 ? Math.sin(share * angle) / sine : share);
  return [
    first * from[0] + second * to[0],
    first * from[1] + second * to[1],
    first * from[2] + second * to[2],
    first * from[3] + second * to[3],
  ];
}

function mix(from: number, to: number, share: number): number {
  return from + share * (to - from);
}

function mixVector(from: Vec3, to: Vec3, share: number): Vec3 {
  return [mix(from[0], to[0], share), mix(from[1], to[1], share), mix(from[2], to[2], share)];
}

function mixArray(from: Float32Array, to: Float32Array, share: number): Float32Array {
  return from.map((value, i) => mix(value, to[i] ?? value, share));
}
