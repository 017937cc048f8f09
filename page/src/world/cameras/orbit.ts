/** A camera that a person turns round the ball: by dragging, with the wheel, with two fingers. */

import { Vector3 } from "three";
import type { Frame } from "../../types";
import type { Solids } from "../solids";
import { type Eye, yawOf } from "./eye";

const NEAREST_M = 1.2;
const FURTHEST_M = 60;
const LOWEST = -1.4;
const HIGHEST = 1.5;
const RAD_PER_PIXEL = 0.006;
const ZOOM_PER_PIXEL = 0.0012;
/** A shorter one is a click. */
const DRAG_PIXELS = 8;
const MARGIN_M = 0.3;

export class OrbitCamera {
  private yaw = 0;
  private pitch = 0.5;
  private distance = 4.5;
  private readonly fingers = new Map<number, PointerEvent>();
  private readonly ball = new Vector3();
  private readonly way = new Vector3();

  /**
   * @param canvas - on which one drags.
   * @param onDrag - told when a mouse drags, whatever camera is in force.
   * @param isOn - whether this camera is in force, so that fingers and wheel turn it.
   */
  constructor(canvas: HTMLElement, onDrag: () => void, isOn: () => boolean) {
    canvas.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "mouse" && !isOn()) return;
      this.fingers.set(event.pointerId, event);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = this.fingers.get(event.pointerId);
      if (before === undefined) return;
      const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
      if (!isOn()) {
        if (Math.hypot(dx, dy) < DRAG_PIXELS) return;
        onDrag();
      }
      if (this.fingers.size === 1) this.turn(dx, dy);
      else this.pinch(event);
      this.fingers.set(event.pointerId, event);
    });
    for (const end of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(end, (event) => this.fingers.delete(event.pointerId));
    }
    canvas.addEventListener(
      "wheel",
      (event) => {
        if (!isOn()) return;
        event.preventDefault();
        this.zoom(Math.exp(event.deltaY * ZOOM_PER_PIXEL));
      },
      { passive: false },
    );
  }

  /** Begin from where another camera is. */
  from(eye: Eye): void {
    const { position, target } = eye;
    this.distance = Math.max(position.distanceTo(target), NEAREST_M);
    this.yaw = yawOf(eye);
    const rise = (position.z - target.z) / this.distance;
    this.pitch = Math.min(Math.max(Math.asin(clampUnit(rise)), LOWEST), HIGHEST);
  }

  look(frame: Frame, solids: Solids, eye: Eye): void {
    this.ball.set(...frame.ball);
    const flat = Math.cos(this.pitch);
    const reach = this.distance + MARGIN_M;
    this.way
      .set(-flat * Math.cos(this.yaw), -flat * Math.sin(this.yaw), Math.sin(this.pitch))
      .multiplyScalar(reach);
    const free = Math.max(solids.free(this.ball, this.way) * reach - MARGIN_M, NEAREST_M / 2);
    eye.position.copy(this.ball).addScaledVector(this.way, Math.min(free, this.distance) / reach);
    eye.target.copy(this.ball);
  }

  private turn(dx: number, dy: number): void {
    this.yaw -= RAD_PER_PIXEL * dx;
    this.pitch = Math.min(Math.max(this.pitch + RAD_PER_PIXEL * dy, LOWEST), HIGHEST);
  }

  private pinch(moved: PointerEvent): void {
    const other = [...this.fingers.values()].find((e) => e.pointerId !== moved.pointerId);
    const before = this.fingers.get(moved.pointerId);
    if (!other || !before) return;
    this.zoom(apart(before, other) / Math.max(apart(moved, other), 1));
  }

  private zoom(by: number): void {
    this.distance = Math.min(Math.max(this.distance * by, NEAREST_M), FURTHEST_M);
  }
}

function apart(a: PointerEvent, b: PointerEvent): number {
  return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
}

function clampUnit(value: number): number {
  return Math.min(Math.max(value, -1), 1);
}
