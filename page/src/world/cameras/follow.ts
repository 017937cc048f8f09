/** A camera that looks along the way the ball rolls, and never loses sight of it. */

import { Vector3 } from "three";
import type { Frame } from "../../types";
import type { Solids } from "../solids";
import { type Eye, easing } from "./eye";

const DISTANCE_M = 3.9;
const PITCH = rad(30);

/** Pitches tried in turn where a wall covers the ball: ever higher over it, at last below. */
const PITCHES = [30, 45, 62, 80, 12].map(rad);

/** A pitch will do from which so much of the distance is free. */
const FREE_ENOUGH = 0.75;

/** What is kept between the camera and what it would else look through. */
const MARGIN_M = 0.3;
const NEAREST_M = 0.9;

/** Slower than this the ball rolls no way to look along. */
const REST_M_S = 0.4;
/** After so long at rest the camera turns back to +x, where W pushes. */
const REST_S = 2.5;
/** At this speed the camera turns to where the ball rolls in `TURN_S`, and else slower. */
const FULL_TURN_M_S = 3;
const TURN_S = 0.55;
const TURN_AT_REST_S = 0.9;
const MOST_TURN_RAD_S = rad(170);

/** Where the ball will be so soon is kept in the picture. */
const AHEAD_S = 0.22;
const MOST_AHEAD_M = 1.5;
/** Thrown up or falling, the ball stays nearer the middle: the picture is wider than high. */
const AHEAD_UPWARDS = 0.4;
const AHEAD_EASE_S = 0.25;

/** Rolling towards the camera, one sees more of the way from higher up. */
const TOWARDS_PITCH = rad(24);

const PITCH_EASE_S = 0.35;
const OUT_EASE_S = 0.5;

export class FollowCamera {
  private yaw = 0;
  private pitch = PITCH;
  private distance = DISTANCE_M;
  private restS = 0;
  private readonly ahead = new Vector3();
  private readonly ball = new Vector3();
  private readonly way = new Vector3();
  private readonly back = new Vector3();

  /** Begin anew, behind the ball: looking along +x, as at the start, or along the way it rolls. */
  cut(frame: Frame): void {
    const [vx, vy] = frame.velocity;
    this.yaw = rolls(frame) ? Math.atan2(vy, vx) : 0;
    this.pitch = PITCH;
    this.distance = DISTANCE_M;
    this.restS = 0;
    this.ahead.set(0, 0, 0);
  }

  /**
   * Move on for a time.
   *
   * @param frame - as drawn.
   * @param solids - what may cover the ball.
   * @param elapsedS - of the game's time: in slow motion the camera turns as slowly as the ball
   *   rolls, and in a pause it stands.
   * @param eye - is changed.
   */
  look(frame: Frame, solids: Solids, elapsedS: number, eye: Eye): void {
    this.ball.set(...frame.ball);
    this.turn(frame, elapsedS);
    this.lookAhead(frame, elapsedS);
    const wanted = this.clearPitch(frame, solids);
    this.pitch += (wanted - this.pitch) * easing(elapsedS, PITCH_EASE_S);
    const free = this.freeDistance(this.pitch, solids);
    // In at once, since a wall is between; out gently.
    if (free < this.distance) this.distance = free;
    else this.distance += (free - this.distance) * easing(elapsedS, OUT_EASE_S);
    eye.position.copy(this.ball).add(this.backwards(this.pitch).multiplyScalar(this.distance));
    eye.target.copy(this.ball).add(this.ahead);
  }

  private turn(frame: Frame, elapsedS: number): void {
    const [vx, vy] = frame.velocity;
    const rolling = rolls(frame);
    this.restS = rolling ? 0 : this.restS + elapsedS;
    if (this.restS > 0 && this.restS < REST_S) return;
    const error = wrapped((rolling ? Math.atan2(vy, vx) : 0) - this.yaw);
    const share = rolling
      ? easing(elapsedS, TURN_S) * Math.min(Math.hypot(vx, vy) / FULL_TURN_M_S, 1)
      : easing(elapsedS, TURN_AT_REST_S);
    const most = MOST_TURN_RAD_S * elapsedS;
    this.yaw = wrapped(this.yaw + Math.min(Math.max(error * share, -most), most));
  }

  private lookAhead(frame: Frame, elapsedS: number): void {
    this.way.set(...frame.velocity).multiplyScalar(AHEAD_S);
    this.way.clampLength(0, MOST_AHEAD_M);
    this.way.z *= AHEAD_UPWARDS;
    this.ahead.lerp(this.way, easing(elapsedS, AHEAD_EASE_S));
  }

  /** Return the first pitch from which the ball is seen, or the one with the most room. */
  private clearPitch(frame: Frame, solids: Solids): number {
    const [vx, vy] = frame.velocity;
    const speed = Math.hypot(vx, vy);
    const towards = -(vx * Math.cos(this.yaw) + vy * Math.sin(this.yaw)) / Math.max(speed, 3);
    const raised = TOWARDS_PITCH * Math.max(towards, 0);
    let best = PITCH;
    let most = 0;
    for (const pitch of PITCHES) {
      const tried = Math.min(pitch + raised, rad(80));
      const free = this.freeDistance(tried, solids);
      if (free >= FREE_ENOUGH * DISTANCE_M) return tried;
      if (free > most) [best, most] = [tried, free];
    }
    return best;
  }

  private freeDistance(pitch: number, solids: Solids): number {
    const way = this.backwards(pitch).multiplyScalar(DISTANCE_M + MARGIN_M);
    const free = solids.free(this.ball, way) * (DISTANCE_M + MARGIN_M) - MARGIN_M;
    return Math.min(Math.max(free, NEAREST_M), DISTANCE_M);
  }

  /** Return the unit vector from the ball to the camera. */
  private backwards(pitch: number): Vector3 {
    const flat = Math.cos(pitch);
    return this.back.set(-flat * Math.cos(this.yaw), -flat * Math.sin(this.yaw), Math.sin(pitch));
  }
}

/** Return whether the ball rolls, and so has a way to look along. */
function rolls({ velocity: [vx, vy] }: Frame): boolean {
  return Math.hypot(vx, vy) > REST_M_S;
}

function wrapped(angle: number): number {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

function rad(degrees: number): number {
  return (degrees * Math.PI) / 180;
}
