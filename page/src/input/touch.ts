/** A stick that comes where a finger is put down. */

import { make, setShown } from "../ui/dom";
import { type Push, stickPush } from "./directions";

/** How far a finger can move the stick, CSS pixels. */
const REACH = 52;
const DEAD_ZONE = 0.28;
const NONE: Push = { ahead: 0, left: 0 };

/** The part of the page on which a finger pushes the ball. */
export class TouchStick {
  /** Where the stick pushes now. */
  push: Push = NONE;
  private finger: number | null = null;
  private centre = { x: 0, y: 0 };
  private readonly zone = make("div", { class: "stick-zone", "aria-hidden": "true" });
  private readonly base = make("div", { class: "stick" });
  private readonly knob = make("div", { class: "stick-knob" });

  /**
   * @param target - what the zone is put into.
   * @param changed - is called when the push has changed.
   */
  constructor(
    target: HTMLElement,
    private readonly changed: () => void,
  ) {
    this.base.append(this.knob);
    this.zone.append(this.base);
    this.zone.hidden = this.base.hidden = true;
    target.append(this.zone);
    this.zone.addEventListener("pointerdown", (event) => this.take(event));
    this.zone.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"] as const) {
      this.zone.addEventListener(end, (event) => {
        if (event.pointerId === this.finger) this.release();
      });
    }
  }

  /**
   * Let fingers push, or not.
   *
   * @param on - whether the game takes keys.
   * @param half - whether only the left half of the page does, the right one being the camera's.
   */
  enable(on: boolean, half: boolean): void {
    if (!on && this.finger !== null) this.release();
    setShown(this.zone, on);
    this.zone.classList.toggle("half", half);
  }

  /** Let the stick go. */
  release(): void {
    this.finger = null;
    this.base.hidden = true;
    this.set(NONE);
  }

  private take(event: PointerEvent): void {
    if (this.finger !== null) return;
    event.preventDefault();
    this.finger = event.pointerId;
    this.zone.setPointerCapture(event.pointerId);
    this.centre = { x: event.clientX, y: event.clientY };
    this.base.style.translate = `${event.clientX}px ${event.clientY}px`;
    this.base.hidden = false;
    this.move(event);
  }

  private move(event: PointerEvent): void {
    if (event.pointerId !== this.finger) return;
    let [x, y] = [(event.clientX - this.centre.x) / REACH, (event.clientY - this.centre.y) / REACH];
    const size = Math.hypot(x, y);
    if (size > 1) [x, y] = [x / size, y / size];
    this.knob.style.translate = `${x * REACH}px ${y * REACH}px`;
    this.set(stickPush(x, y, DEAD_ZONE));
  }

  private set(push: Push): void {
    this.push = push;
    this.changed();
  }
}
