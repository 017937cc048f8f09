/** Ui: all panels. It shows what it is given and asks for what a person wants; it decides nothing. */

import { type Command, onCommand } from "../input/commands";
import type { Actions, View } from "../types";
import type { Dialog } from "./dialog";
import { make } from "./dom";
import { EndPanel } from "./end";
import { HelpPanel } from "./help";
import { Hints } from "./hints";
import { Hud } from "./hud";
import { Intro } from "./intro";
import { Messages } from "./messages";
import { ConnectionOverlay, ProblemsPanel, SeatLine } from "./overlays";
import { PausePanel } from "./pause";
import { ResearchPanel } from "./research";
import { SettingsPanel } from "./settings";
import { StartPage } from "./start";
import { Timeline } from "./timeline";

/** How far the arrows go in a replay, seconds. */
const SEEK_S = 1;

/** The panel that the game asks for, below what a person has opened. */
type Base = "start" | "pause" | "end" | null;

/**
 * Return the panel that the game asks for.
 *
 * @param view - how the game stands.
 * @param research - whether the researcher's panels are open: they take the place of the pause's.
 * @param before - the one of the moment before; the start page stays while a level is loaded.
 */
function baseOf(view: View, research: boolean, before: Base): Base {
  const { hello, seat, frame, level, result } = view;
  if (hello === null || hello.mode === "replay") return null;
  const choosing = frame === null ? level === null || before === "start" : frame.phase === "start";
  if (frame === null || choosing) return choosing && seat === "player" ? "start" : null;
  if (frame.phase === "ended") return result === null ? null : "end";
  return frame.phase === "paused" && seat === "player" && !research ? "pause" : null;
}

/** The panels over the world. */
export class Ui {
  private view: View | null = null;
  private base: Base = null;
  private opened: "settings" | "help" | null = null;
  private research: boolean | null = null;
  private readonly start: StartPage;
  private readonly pause: PausePanel;
  private readonly end: EndPanel;
  private readonly settings: SettingsPanel;
  private readonly help: HelpPanel;
  private readonly hud: Hud;
  private readonly intro: Intro;
  private readonly hints = new Hints();
  private readonly messages = new Messages();
  private readonly connection = new ConnectionOverlay();
  private readonly seat: SeatLine;
  private readonly problems = new ProblemsPanel();
  private readonly researchPanel = new ResearchPanel();
  private readonly timeline: Timeline;
  private readonly below: HTMLElement;

  /**
   * @param root - what the panels are put into.
   * @param actions - what is asked for by.
   */
  constructor(
    root: HTMLElement,
    private readonly actions: Actions,
  ) {
    const open = (panel: "settings" | "help"): void => this.open(panel);
    const close = (): void => this.open(null);
    this.start = new StartPage(actions, open);
    this.pause = new PausePanel(actions, open);
    this.end = new EndPanel(actions);
    this.settings = new SettingsPanel(actions, close);
    this.help = new HelpPanel(close);
    this.hud = new Hud(() => open("settings"));
    this.intro = new Intro(actions);
    this.seat = new SeatLine(actions);
    this.timeline = new Timeline(actions);
    const foot = make("div", { class: "foot" }, this.hints.element, this.seat.element);
    foot.append(this.timeline.element);
    this.below = make(
      "div",
      { class: "below" },
      this.hud.element,
      this.intro.element,
      ...this.messages.elements,
      this.researchPanel.element,
      foot,
    );
    root.classList.add("ui");
    root.append(
      this.below,
      ...[this.start, this.pause, this.end].map((panel) => panel.element),
      this.problems.element,
      ...[this.settings, this.help].map((panel) => panel.element),
      this.connection.element,
    );
    onCommand((command) => this.obey(command));
  }

  /** Show how the game stands; up to 60 times a second. */
  update(view: View): void {
    this.view = view;
    this.research ??= view.hello && (view.hello.mode === "replay" || view.hello.agent !== null);
    const research = this.research === true;
    const base = baseOf(view, research, this.base);
    this.base = base;
    if (base === "start") this.start.update(view);
    if (base === "pause") this.pause.update(view);
    if (base === "end") this.end.update(view);
    this.settings.update(view);
    this.hud.update(view);
    this.intro.update(view);
    this.hints.update(view);
    this.messages.update(view, performance.now());
    this.connection.update(view, base === "start");
    this.seat.update(view);
    this.problems.update(view);
    const replay = view.hello?.mode === "replay";
    const inGame = view.frame !== null && base !== "start" && base !== "end";
    this.researchPanel.update(view, research && inGame);
    this.timeline.update(view, (research || replay) && inGame);
    this.showPanels();
  }

  private showPanels(): void {
    const base = this.base;
    this.start.show(base === "start");
    this.pause.show(base === "pause");
    this.end.show(base === "end");
    this.settings.show(this.opened === "settings");
    this.help.show(this.opened === "help");
    const top = this.top();
    const panels = [this.start, this.pause, this.end, this.settings, this.help];
    for (const panel of panels) setInert(panel.element, top !== null && panel !== top);
    // Who watches is told that at the end, too, and may ask for the controls.
    setInert(this.below, this.opened !== null || (top !== null && this.view?.seat === "player"));
  }

  private top(): Dialog | null {
    const panels = [this.help, this.settings, this.end, this.pause, this.start];
    return panels.find((panel) => panel.isShown) ?? null;
  }

  private open(panel: "settings" | "help" | null): void {
    if (panel !== null) this.stand();
    this.opened = panel;
    this.showPanels();
  }

  /** Pause, if something moves that the person here steers. */
  private stand(): void {
    const { frame, seat, hello } = this.view ?? {};
    const moves = frame?.phase === "intro" || frame?.phase === "playing";
    if (moves && seat === "player" && hello?.mode !== "replay")
      this.actions.send({ type: "pause" });
  }

  private obey(command: Command): void {
    const view = this.view;
    if (view?.hello == null) return;
    const deeds: Record<Command, () => void> = {
      main: () => this.pressMain(view),
      pause: () => this.pauseOrGoOn(view),
      leave: () => this.stand(),
      restart: () => this.ask(view, "restart"),
      camera: () => this.actions.nextCamera(),
      "hand back": () => this.handBack(view),
      help: () => this.open(this.opened === "help" ? null : "help"),
      mute: () => this.actions.setSettings({ muted: !view.settings.muted }),
      research: () => this.toggleResearch(view),
      push: () => this.skipIntro(view),
      step: () => view.seat === "player" && this.timeline.stepOn(view),
      slower: () => view.seat === "player" && this.timeline.changeSpeed(view, false),
      faster: () => view.seat === "player" && this.timeline.changeSpeed(view, true),
      back: () => this.go(view, -1, 0),
      forward: () => this.go(view, 1, 0),
      up: () => this.go(view, 0, -1),
      down: () => this.go(view, 0, 1),
    };
    deeds[command]();
  }

  private pressMain(view: View): void {
    const top = this.top();
    if (top !== null) top.pressMain();
    else this.skipIntro(view);
  }

  private pauseOrGoOn(view: View): void {
    const phase = view.frame?.phase;
    if (this.opened !== null) this.open(null);
    else if (phase === "paused") this.ask(view, "resume");
    else if (phase === "ended" && view.hello?.mode === "replay") this.ask(view, "restart");
    else if (phase === "playing" || phase === "intro") this.ask(view, "pause");
  }

  private handBack(view: View): void {
    if (!view.frame?.hasAgent) return;
    this.ask(view, "hand_back");
    if (view.frame.phase === "paused") this.ask(view, "resume");
  }

  private toggleResearch(view: View): void {
    if (view.frame !== null && this.base !== "start" && this.base !== "end") {
      this.research = !this.research;
    }
  }

  private skipIntro(view: View): void {
    if (view.frame?.phase === "intro") this.ask(view, "skip");
  }

  /** The arrows: a moment of a replay, or a level of the start page. */
  private go(view: View, columns: number, rows: number): void {
    if (this.opened !== null) return;
    if (view.hello?.mode === "replay") this.timeline.seekBy(view, SEEK_S * columns);
    else if (this.start.isShown) this.start.move(columns, rows);
  }

  private ask(view: View, type: "restart" | "pause" | "resume" | "hand_back" | "skip"): void {
    if (view.seat === "player" && view.frame?.phase !== "start") this.actions.send({ type });
  }
}

function setInert(element: HTMLElement, inert: boolean): void {
  if (element.inert !== inert) element.inert = inert;
}
