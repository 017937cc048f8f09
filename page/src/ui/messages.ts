/** What comes and goes by itself: a fall, the camera's name, notices, who plays. */

import type { Frame, View } from "../types";
import { cameraName } from "./cameras";
import { make, setShown, setText } from "./dom";
import { counted } from "./format";

const FALL_MS = 2000;
const CAMERA_MS = 1600;

/** A line that goes after a while. */
class Passing {
  readonly element: HTMLElement;
  private until = 0;

  constructor(kind: string, role = "status") {
    this.element = make("p", { class: `panel ${kind}`, role, hidden: "" });
  }

  say(text: string, duration: number, now: number): void {
    setText(this.element, text);
    this.until = now + duration;
  }

  update(now: number): void {
    setShown(this.element, now < this.until);
  }
}

/** Messages over the game, and what screen readers are told of it. */
export class Messages {
  readonly elements: readonly HTMLElement[];
  private readonly fall = new Passing("fall", "alert");
  private readonly camera = new Passing("camera");
  private readonly notice = make("p", { class: "panel notice", role: "status", hidden: "" });
  private readonly agent = make("p", { class: "panel agent-line", hidden: "" });
  private readonly told = make("p", { class: "for-readers", "aria-live": "polite" });
  private before: Frame | null = null;
  private cameraBefore = "";

  constructor() {
    const top = make("div", { class: "messages" }, this.agent, this.notice);
    top.append(this.camera.element, this.fall.element);
    this.elements = [top, this.told];
  }

  /**
   * Show what is new.
   *
   * @param view - how the game stands.
   * @param now - milliseconds.
   */
  update(view: View, now: number): void {
    const { frame, settings, notice, hello } = view;
    setShown(this.notice, notice !== null);
    if (notice !== null) setText(this.notice, notice);
    if (frame !== null) {
      if (this.before !== null && frame.falls > this.before.falls) {
        this.fall.say("You fell. Once more!", FALL_MS, now);
      }
      const news = newsOf(this.before, frame);
      if (news !== "") setText(this.told, news);
      const camera = cameraName(settings.camera, frame.cameraMode);
      if (camera !== this.cameraBefore) {
        if (this.cameraBefore !== "") this.camera.say(`Camera: ${camera}`, CAMERA_MS, now);
        this.cameraBefore = camera;
      }
      this.before = frame;
    }
    const moving = frame?.phase === "playing" && frame.hasAgent && hello?.mode !== "replay";
    setShown(this.agent, moving === true);
    if (moving) setText(this.agent, agentLine(view));
    for (const one of [this.fall, this.camera]) one.update(now);
  }
}

/** Return what a screen reader is told of a frame after another, "" if nothing. */
export function newsOf(before: Frame | null, frame: Frame): string {
  if (before === null) return "";
  if (frame.outcome !== before.outcome && frame.outcome === "finish") return "Finish";
  if (frame.outcome !== before.outcome && frame.outcome === "time limit") return "The time is up";
  if (frame.coins > before.coins) return counted(frame.coins, "coin");
  return "";
}

function agentLine({ frame, seat, hello }: View): string {
  const name = hello?.agent ? `The agent ${hello.agent}` : "The agent";
  if (seat !== "player") return `${frame?.agentPlays ? name : "A person"} plays`;
  if (frame?.agentPlays) return `${name} plays. Press a direction to take over.`;
  return "You play. T hands the ball back to the agent.";
}
