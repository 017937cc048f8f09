/** A camera that looks along the way the ball rolls, and never loses sight of it. */

import { Vector3 } from "three";
import type { Frame } from "../../types";
import type { Solids } from "../solids";
import { type Eye, easing } from "./eye";

const DISTANCE_M = 3.9;
const PITCH = rad(30);

/** Pitches tried in turn where a wall covers the ball: ever higher over it, at last below. */
const HIGHEST = rad(80);
const PITCHES = [30, 45, 62, 80, 12].map(rad);

/** A pitch will do from which so much of the distance is free. */
const FREE_ENOUGH = 0.75;

/** How far below its middle the ball is still to be seen. */
const FOOT_M = 0.28;

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

/** Cosine of how far off the view the ball rolls when the camera stops turning after it. */
const TURNS_NO_MORE = Math.cos(rad(110));

/** Where the ball will be so soon is kept in the picture. */
const AHEAD_S = 0.22;
const MOST_AHEAD_M = 1.5;
/** Thrown up or falling, the ball stays nearer the middle: the picture is wider than high. */
const AHEAD_UPWARDS = 0.4;
const AHEAD_EASE_S = 0.25;

/** Rolling towards the camera, one sees more of the way from higher up and further away. */
const TOWARDS_PITCH = rad(28);
const TOWARDS_DISTANCE_M = 1.8;

/** In flight one looks down on where the ball will land, from further away: so much for a height,
 * once it rises no faster than this; over nothing, once it falls. */
const FLIGHT_PITCH = rad(42);
const FLIGHT_DISTANCE_M = 2.5;
const HIGH_M = 5;
/** Of that height, what is no flight: the ball's own radius, and a hop. */
const GROUNDED = 0.2;
const RISES_M_S = 1.5;
const FALLS_M_S = 2;

const PITCH_EASE_S = 0.35;
const PITCH_EASE_COVERED_S = 0.1;
const OUT_EASE_S = 0.5;

export class FollowCamera {
  private yaw = 0;
  private pitch = PITCH;
  private distance = DISTANCE_M;
  private reach = DISTANCE_M;
  private restS = 0;
  private readonly ahead = new Vector3();
  private readonly ball = new Vector3();
  private readonly foot = new Vector3();
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
    this.foot.copy(this.ball).z -= FOOT_M;
    this.turn(frame, elapsedS);
    this.lookAhead(frame, elapsedS);
    const flight = this.flight(frame, solids);
    const towards = this.towards(frame);
    this.reach = DISTANCE_M + FLIGHT_DISTANCE_M * flight + TOWARDS_DISTANCE_M * towards;
    const wanted = this.clearPitch(FLIGHT_PITCH * flight + TOWARDS_PITCH * towards, solids);
    const free = this.freeDistance(this.ball, this.pitch, solids);
    const pitchEaseS = free < FREE_ENOUGH * this.reach ? PITCH_EASE_COVERED_S : PITCH_EASE_S;
    this.pitch += (wanted - this.pitch) * easing(elapsedS, pitchEaseS);
    // In at once where a wall is between; out gently.
    const room = this.freeDistance(this.ball, this.pitch, solids);
    if (room < this.distance) this.distance = room;
    else this.distance += (room - this.distance) * easing(elapsedS, OUT_EASE_S);
    eye.position.copy(this.ball).add(this.backwards(this.pitch).multiplyScalar(this.distance));
    eye.target.copy(this.ball).add(this.ahead);
  }

  private turn(frame: Frame, elapsedS: number): void {
    const [vx, vy] = frame.velocity;
    const rolling = rolls(frame);
    this.restS = rolling ? 0 : this.restS + elapsedS;
    if (this.restS > 0 && this.restS < REST_S) return;
    const error = (rolling ? Math.atan2(vy, vx) : 0) - this.yaw;
    const share = rolling
      ? easing(elapsedS, TURN_S) * Math.min(Math.hypot(vx, vy) / FULL_TURN_M_S, 1)
      : easing(elapsedS, TURN_AT_REST_S);
    const most = MOST_TURN_RAD_S * elapsedS;
    const turn = rolling ? sideways(error) : wrapped(error);
    this.yaw = wrapped(this.yaw + Math.min(Math.max(turn * share, -most), most));
  }

  private lookAhead(frame: Frame, elapsedS: number): void {
    this.way.set(...frame.velocity).multiplyScalar(AHEAD_S);
    this.way.clampLength(0, MOST_AHEAD_M);
    this.way.z *= AHEAD_UPWARDS;
    this.ahead.lerp(this.way, easing(elapsedS, AHEAD_EASE_S));
  }

  /** Return how high the ball flies, 0 to 1, if where it lands is what matters. */
  private flight(frame: Frame, solids: Solids): number {
    const rise = frame.velocity[2];
    const ground = solids.below(this.ball);
    if (ground === null) return rise < -FALLS_M_S ? 1 : 0;
    const height = this.ball.z - ground.height;
    return rise < RISES_M_S ? Math.min(Math.max(height / HIGH_M - GROUNDED, 0), 1) : 0;
  }

  /** Return how fast the ball rolls towards the camera, 0 to 1. */
  private towards(frame: Frame): number {
    const [vx, vy] = frame.velocity;
    const speed = -(vx * Math.cos(this.yaw) + vy * Math.sin(this.yaw));
    return Math.min(Math.max(speed / FULL_TURN_M_S, 0), 1);
  }

  /** Return the first pitch from which the ball is seen, or the one with the most room. */
  private clearPitch(raised: number, solids: Solids): number {
    let best = PITCH;
    let most = 0;
    for (const pitch of PITCHES) {
      const tried = Math.min(pitch + raised, HIGHEST);
      const free = Math.min(
        this.freeDistance(this.ball, tried, solids),
        this.freeDistance(this.foot, tried, solids),
      );
      if (free >= FREE_ENOUGH * this.reach) return tried;
      if (free > most) [best, most] = [tried, free];
    }
    return best;
  }

  /** Return how far from a point of the ball one may be to see it. */
  private freeDistance(point: Vector3, pitch: number, solids: Solids): number {
    const reach = this.reach + MARGIN_M;
    const free = solids.free(point, this.backwards(pitch).multiplyScalar(reach));
    return Math.min(Math.max(free * reach - MARGIN_M, NEAREST_M), this.reach);
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

/**
 * Return by how much to turn to a way that is so far off, radians.
 *
 * It is the sideways share of the speed, and nothing once the ball rolls towards the camera: keys
 * may be relative to the view, and who holds S would else steer in a circle.
 */
function sideways(error: number): number {
  const towards = (Math.cos(error) - TURNS_NO_MORE) / -TURNS_NO_MORE;
  return Math.sin(error) * Math.min(Math.max(towards, 0), 1);
}

function wrapped(angle: number): number {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

function rad(degrees: number): number {
  return (degrees * Math.PI) / 180;
}
