/** The time line: play, step, go to a moment, slow motion, and going on from there. */

import { giveCommand } from "../input/commands";
import type { Actions, View } from "../types";
import { button, make, setAttribute, setShown, setText } from "./dom";
import { formatTime } from "./format";
import { drawIcon } from "./icon";

const SPEEDS: readonly number[] = [0.1, 0.25, 0.5, 1, 2];

/** A moment so near to the last one is the last one; seconds, less than any control step. */
const AT_END_S = 5e-4;
/** While the bar is drawn along, the server is asked at most this often; milliseconds. */
const SEEK_EVERY_MS = 50;

/** The bar at the bottom. */
export class Timeline {
  readonly element: HTMLElement;
  private readonly play: HTMLButtonElement;
  private readonly step: HTMLButtonElement;
  private readonly bar: HTMLInputElement;
  private readonly moment = make("output", { class: "moment" });
  private readonly speed = make("select", { "aria-label": "Speed of time" });
  private readonly branch: HTMLButtonElement;
  private sought: number | null = null;
  private waiting = 0;

  /** @param actions - what the server is told by. */
  constructor(private readonly actions: Actions) {
    this.play = button(drawIcon("pause"), "tool", () => giveCommand("pause"));
    this.step = button(drawIcon("step"), "tool", () => giveCommand("step"));
    this.step.title = "One step (.)";
    setAttribute(this.step, "aria-label", "One step");
    this.bar = make("input", {
      type: "range",
      step: "any",
      "aria-label": "Moment",
      class: "scrub",
    });
    this.bar.addEventListener("input", () => this.drawAlong());
    this.bar.addEventListener("change", () => this.sendSeek());
    const speeds = SPEEDS.map((one) => make("option", { value: String(one) }, `${one}×`));
    this.speed.append(...speeds);
    this.speed.addEventListener("change", () => {
      actions.send({ type: "speed", factor: Number(this.speed.value) });
      // A list that has the focus takes letters, which are to push the ball.
      this.speed.blur();
    });
    this.branch = button("Go on from here", "main", () => actions.send({ type: "resume" }));
    this.element = make(
      "section",
      { class: "panel timeline", "aria-label": "Time line" },
      this.play,
      this.step,
      this.bar,
      this.moment,
      this.speed,
      this.branch,
    );
  }

  /**
   * Show the moment.
   *
   * @param view - how the game stands.
   * @param shown - whether the bar is wanted.
   */
  update(view: View, shown: boolean): void {
    const { frame, timeline, hello, seat } = view;
    setShown(this.element, shown && frame !== null && seat === "player");
    if (!shown || frame === null) return;
    const paused = frame.phase === "paused";
    const replay = hello?.mode === "replay";
    const stands = paused || frame.phase === "ended";
    const label = stands ? "Go on" : "Pause";
    if (this.play.title !== label) {
      this.play.title = label;
      setAttribute(this.play, "aria-label", label);
      this.play.replaceChildren(drawIcon(stands ? "play" : "pause"));
    }
    this.step.disabled = !paused;
    const seekable = timeline !== null && (paused || replay);
    this.bar.disabled = !seekable;
    if (timeline !== null) {
      setAttribute(this.bar, "min", String(timeline.first_s));
      setAttribute(this.bar, "max", String(Math.max(timeline.last_s, frame.timeS)));
    }
    if (!seekable) this.bar.value = this.bar.max;
    else if (this.sought === null) this.bar.value = String(frame.timeS);
    const last = seekable ? ` / ${formatTime(timeline.last_s)}` : "";
    setText(this.moment, formatTime(this.sought ?? frame.timeS) + last);
    const speed = String(SPEEDS.find((one) => Math.abs(one - frame.speed) < 1e-3) ?? "");
    if (this.speed !== document.activeElement && this.speed.value !== speed) {
      this.speed.value = speed;
    }
    const back = seekable && frame.timeS < timeline.last_s - AT_END_S;
    setShown(this.branch, paused && back && timeline.can_branch);
  }

  /** Go on by a control step: one that was made, or after the last one a new one. */
  stepOn({ frame, level, timeline }: View): void {
    if (frame?.phase !== "paused") return;
    const step = level?.control_dt_s ?? 0;
    // Frames tell their time in 32 bits, so half a step is the surest bound.
    const made = timeline !== null && frame.timeS + step / 2 < timeline.last_s;
    this.actions.send(made ? { type: "seek", time_s: frame.timeS + step } : { type: "step" });
  }

  /** Go some seconds on, or back. */
  seekBy(view: View, seconds: number): void {
    const { frame, timeline } = view;
    if (frame === null || timeline === null) return;
    const wanted = (this.sought ?? frame.timeS) + seconds;
    const time = Math.min(Math.max(wanted, timeline.first_s), timeline.last_s);
    this.actions.send({ type: "seek", time_s: time });
  }

  /** Go to the next speed, slower or faster. */
  changeSpeed(view: View, faster: boolean): void {
    const now = view.frame?.speed ?? 1;
    const apart = SPEEDS.filter((one) => (faster ? one > now : one < now));
    const next = faster ? apart[0] : apart.at(-1);
    if (next !== undefined) this.actions.send({ type: "speed", factor: next });
  }

  private drawAlong(): void {
    this.sought = Number(this.bar.value);
    if (this.waiting !== 0) return;
    this.waiting = window.setTimeout(() => {
      this.waiting = 0;
      if (this.sought !== null) this.actions.send({ type: "seek", time_s: this.sought });
    }, SEEK_EVERY_MS);
  }

  private sendSeek(): void {
    window.clearTimeout(this.waiting);
    this.waiting = 0;
    this.sought = null;
    this.actions.send({ type: "seek", time_s: Number(this.bar.value) });
  }
}
