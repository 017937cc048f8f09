/** What is always in sight while the ball rolls: points, time, coins, the medal in reach, buttons. */

import { type Command, giveCommand } from "../input/commands";
import type { Medal, View } from "../types";
import { button, make, setAttribute, setProperty, setShown, setText } from "./dom";
import { formatTime } from "./format";
import { drawIcon, type IconName } from "./icon";
import { drawMedal, medalInReach } from "./medal";

/** The panel at the top left and the buttons at the top right. */
export class Hud {
  readonly element: HTMLElement;
  private readonly panel: HTMLElement;
  private readonly points = make("span", { class: "points" });
  private readonly time = make("span", { class: "time" });
  private readonly coins = make("span", { class: "coins" });
  private readonly bar = make("span", { class: "coin-bar" });
  private readonly speed = make("span", { class: "speed" });
  private readonly reach = make("span", { class: "reach" });
  private readonly reachText = make("span");
  private readonly marks = make("span", { class: "marks" });
  private readonly buttons: Partial<Record<Command, HTMLButtonElement>> = {};
  private medal: Medal | null = null;

  /** @param openSettings - shows the settings. */
  constructor(openSettings: () => void) {
    this.panel = make(
      "div",
      { class: "panel score" },
      make("div", { class: "score-line" }, this.points, this.time),
      make("div", { class: "score-line" }, this.coins, this.bar),
      this.reach,
      this.speed,
      this.marks,
    );
    this.reach.append(this.reachText);
    const tools = make("nav", { class: "hud-tools", "aria-label": "Game" });
    const tool = (icon: IconName, label: string, command: Command): void => {
      const one = button("", "tool", () => giveCommand(command));
      this.buttons[command] = one;
      this.label(command, icon, label);
      tools.append(one);
    };
    tool("pause", "Pause (P)", "pause");
    tool("restart", "Restart (R)", "restart");
    tool("camera", "Next camera (C)", "camera");
    tool("research", "What an agent sees, time line (G)", "research");
    tool("sound", "Sound off (M)", "mute");
    const settings = button(drawIcon("settings"), "tool", openSettings);
    settings.setAttribute("aria-label", "Settings");
    settings.title = "Settings";
    tools.append(settings);
    tool("help", "Help (H)", "help");
    // After a click the keys are the game's again: Enter is not to press the same once more.
    tools.addEventListener("click", ({ detail }) => {
      if (detail > 0 && document.activeElement instanceof HTMLElement)
        document.activeElement.blur();
    });
    this.element = make("div", { class: "hud" }, this.panel, tools);
  }

  /** Show how the game stands. */
  update(view: View): void {
    const { frame, scene, level, hello, seat, settings } = view;
    const shown = frame !== null && frame.phase !== "start" && scene !== null && level !== null;
    setShown(this.element, shown);
    if (!shown) return;
    setText(this.points, String(level.points_per_coin * frame.coins));
    setText(this.time, formatTime(frame.timeS));
    setText(this.coins, `${frame.coins} of ${scene.coins} coins`);
    const share = scene.coins > 0 ? frame.coins / scene.coins : 1;
    setProperty(this.bar, "--share", share.toFixed(3));
    this.showReach(frame.timeS, scene.par_time_s);
    const speed = Math.hypot(...frame.velocity);
    setShown(this.speed, settings.speedLabels);
    setText(this.speed, settings.speedLabels ? `${speed.toFixed(1)} m/s` : "");
    this.showMarks(view);
    const steers = seat === "player" && hello?.mode !== "replay";
    this.show("restart", steers);
    this.show("pause", seat === "player");
    this.show("research", hello !== null && (hello.mode !== "watch" || frame.hasAgent));
    if (settings.muted) this.label("mute", "mute", "Sound on (M)");
    else this.label("mute", "sound", "Sound off (M)");
    const stands = frame.phase === "paused" || frame.phase === "ended";
    if (stands) this.label("pause", "play", "Go on (P)");
    else this.label("pause", "pause", "Pause (P)");
  }

  private label(command: Command, icon: IconName, label: string): void {
    const one = this.buttons[command];
    if (one === undefined || one.title === label) return;
    one.replaceChildren(drawIcon(icon));
    one.title = label;
    setAttribute(one, "aria-label", label);
  }

  private show(command: Command, shown: boolean): void {
    const one = this.buttons[command];
    if (one) setShown(one, shown);
  }

  private showReach(time: number, par: number | null): void {
    const medal = medalInReach(time, par);
    setShown(this.reach, medal !== null);
    if (medal === null || par === null) return;
    if (medal !== this.medal) {
      this.medal = medal;
      this.reach.replaceChildren(drawMedal(medal), this.reachText);
    }
    const left = `par ${formatTime(par)}`;
    setText(this.reachText, medal === "gold" ? left : `${left} is over`);
  }

  private showMarks({ frame, hello }: View): void {
    const marks = [
      ...(frame?.recording ? ["● recording"] : []),
      ...(frame?.rewound && hello?.mode === "play" ? ["practice, does not count"] : []),
      ...(frame && frame.speed !== 1 ? [`${Number(frame.speed.toPrecision(2))}× speed`] : []),
    ];
    setShown(this.marks, marks.length > 0);
    setText(this.marks, marks.join(" · "));
  }
}
