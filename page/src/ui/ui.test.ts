import { beforeEach, expect, it } from "vitest";
import { clearPages, fakeFrame, fakeRow, fakeView } from "../fakes";
import { type Command, giveCommand } from "../input/commands";
import type { Actions, ResultMessage, Settings, ToServer, View } from "../types";
import { Ui } from "./index";

const RESULT: ResultMessage = {
  type: "result",
  outcome: "finish",
  coins: 12,
  coins_in_level: 12,
  score_percent: 100,
  time_s: 18.8,
  points: 120,
  medal: "gold",
  best_time: true,
  best_coins: true,
  counts: true,
  next: "ice",
};

let sent: ToServer[];
let settings: Partial<Settings>;
let ui: Ui;

clearPages();

beforeEach(() => {
  sent = [];
  settings = {};
  ui = new Ui(document.body, {
    send: (message) => sent.push(message),
    setSettings: (change) => Object.assign(settings, change),
    nextCamera: () => undefined,
  } satisfies Actions);
});

function show(change: Partial<View>, hello = {}): View {
  const view = fakeView(change, hello);
  ui.update(view);
  return view;
}

function shown(selector: string): boolean {
  const element = document.querySelector<HTMLElement>(selector);
  return element !== null && element.closest("[hidden]") === null;
}

function asked(command: Command): string[] {
  sent.length = 0;
  giveCommand(command);
  return sent.map(({ type }) => type);
}

function text(selector: string): string {
  return document.querySelector(selector)?.textContent ?? "";
}

it("begins the level that was chosen last when Enter is pressed", () => {
  show({ frame: fakeFrame({ phase: "start" }) });
  expect(shown(".start")).toBe(true);
  giveCommand("forward");
  expect(asked("main")).toEqual(["choose", "start"]);
  expect(sent[0]).toEqual({ type: "choose", level: "ice" });
  // It is still being loaded, and nobody is asked twice.
  show({ frame: fakeFrame({ phase: "start" }) });
  expect(text(".hero h2")).toBe("2. Thin ice");
  expect(asked("main")).toEqual(["start"]);
});

it("keeps the focus on a card when the levels are told of anew", () => {
  show({ frame: fakeFrame({ phase: "start" }) });
  document.querySelector<HTMLElement>('[data-level="ice"]')?.focus();
  show({ frame: fakeFrame({ phase: "start" }) });
  expect(document.activeElement?.getAttribute("data-level")).toBe("ice");
});

it("shows the level that the server has when that was away before it had loaded another", () => {
  show({ frame: fakeFrame({ phase: "start" }) });
  giveCommand("forward");
  giveCommand("main");
  show({ frame: fakeFrame({ phase: "start" }), connection: "lost" });
  expect(text(".hero h2")).toBe("1. Open floor");
  expect(asked("main")).toEqual(["start"]);
});

it("keeps the start page while a level is loaded, and no other panel", () => {
  show({ frame: null, scene: null, level: null });
  expect(shown(".start")).toBe(true);
  show({ frame: null, scene: null });
  expect(shown(".start")).toBe(true);
  show({ frame: fakeFrame({ phase: "ended" }), result: RESULT });
  show({ frame: null, scene: null });
  expect(shown(".end") || shown(".start")).toBe(false);
  expect(shown(".cover")).toBe(true);
});

it("skips the intro with Enter or a direction", () => {
  show({ frame: fakeFrame({ phase: "intro", keysInS: 3.2 }) });
  expect(text(".intro .wait")).toBe("The keys work in 4 s");
  expect(asked("main")).toEqual(["skip"]);
  expect(asked("push")).toEqual(["skip"]);
  show({});
  expect(asked("push")).toEqual([]);
});

it("pauses, and goes on from the pause, but first closes what lies over it", () => {
  show({});
  expect(asked("pause")).toEqual(["pause"]);
  show({ frame: fakeFrame({ phase: "paused" }) });
  expect(shown(".pause")).toBe(true);
  giveCommand("help");
  expect(shown(".help")).toBe(true);
  expect(asked("pause")).toEqual([]);
  expect(shown(".help")).toBe(false);
  expect(asked("pause")).toEqual(["resume"]);
});

it("stands still while the help is open, and when the page is left", () => {
  show({});
  expect(asked("help")).toEqual(["pause"]);
  expect(asked("help")).toEqual([]);
  expect(asked("leave")).toEqual(["pause"]);
  show({}, { mode: "replay" });
  expect(asked("leave")).toEqual([]);
});

it("lights the next level only for who may go there", () => {
  show({ frame: fakeFrame({ phase: "ended", outcome: "finish" }), result: RESULT });
  expect(text(".end button.main")).toBe("Next: Thin ice");
  expect(asked("main")).toEqual(["next"]);
  const result = { ...RESULT, coins: 9, next: null, medal: "bronze" as const, best_time: false };
  show({ frame: fakeFrame({ phase: "ended", outcome: "finish" }), result });
  expect(text(".end-word")).toContain("3 left");
  expect(asked("main")).toEqual(["restart"]);
});

it("shows who watches no button that steers", () => {
  const watches = { seat: "spectator" as const };
  for (const phase of ["start", "intro", "playing", "paused", "ended"] as const) {
    show({ ...watches, frame: fakeFrame({ phase, keysInS: 1 }), result: RESULT });
    const buttons = [...document.querySelectorAll<HTMLElement>("button")];
    const seen = buttons.filter((one) => one.closest("[hidden]") === null);
    const labels = seen.map((one) => one.getAttribute("aria-label") ?? one.textContent ?? "");
    expect(labels).toContain("Ask to play");
    expect(labels.join()).not.toMatch(/Start|Restart|Pause|Next level|Begin|Go on|Levels|Again/);
    for (const command of ["main", "pause", "restart", "step", "hand back", "push"] as const) {
      expect(asked(command)).toEqual([]);
    }
  }
});

it("tells who asked for the controls to wait, until they are given", () => {
  show({ seat: "spectator" });
  document.querySelector<HTMLElement>(".seat button")?.click();
  expect(sent).toEqual([{ type: "ask_seat" }]);
  show({ seat: "spectator" });
  expect(shown(".seat button")).toBe(false);
  show({ seat: "player" });
  expect(shown(".seat")).toBe(false);
});

it("scrubs a pause with the time line in the place of its panel, and branches", () => {
  const timeline = { type: "timeline" as const, first_s: 0, last_s: 20, can_branch: true };
  show({ frame: fakeFrame({ phase: "paused", timeS: 20 }), timeline });
  giveCommand("research");
  show({ frame: fakeFrame({ phase: "paused", timeS: 20 }), timeline });
  expect(shown(".pause")).toBe(false);
  expect(shown(".timeline .main")).toBe(false);
  expect(asked("step")).toEqual(["step"]);
  const bar = document.querySelector<HTMLInputElement>(".scrub");
  if (bar === null) throw new Error("there is no bar");
  bar.value = "12.5";
  bar.dispatchEvent(new Event("change"));
  expect(sent.at(-1)).toEqual({ type: "seek", time_s: 12.5 });
  show({ frame: fakeFrame({ phase: "paused", timeS: 12.5 }), timeline });
  expect(text(".timeline .main")).toBe("Go on from here");
  expect(asked("step")).toEqual(["seek"]);
  expect(sent.at(-1)).toEqual({ type: "seek", time_s: 12.5 + 1 / 240 });
  expect(asked("slower")).toEqual(["speed"]);
  expect(sent.at(-1)).toEqual({ type: "speed", factor: 0.5 });
});

it("seeks in a replay with the arrows, within it, and plays it again from its end", () => {
  const timeline = { type: "timeline" as const, first_s: 0, last_s: 20, can_branch: false };
  show({ frame: fakeFrame({ timeS: 19.5 }), timeline }, { mode: "replay" });
  expect(shown(".timeline")).toBe(true);
  expect(asked("forward")).toEqual(["seek"]);
  expect(sent.at(-1)).toEqual({ type: "seek", time_s: 20 });
  show({ frame: fakeFrame({ phase: "ended", timeS: 20 }), timeline }, { mode: "replay" });
  expect(shown(".timeline")).toBe(true);
  expect(asked("pause")).toEqual(["restart"]);
});

it("shows what an agent thinks, and hands the ball back to it", () => {
  const agent = {
    type: "agent" as const,
    actions: ["none", "W"],
    probabilities: [0.25, 0.75],
    value: 1.5,
    entries: [{ name: "position", value: [1, 2, 3] }],
    reward_terms: { coin: 2 },
  };
  const frame = fakeFrame({ hasAgent: true, keys: "wd", totalReward: 2 });
  show({ frame, agent }, { agent: "ppo" });
  expect(text(".research")).toMatch(/none25 %W75 %.*value.*1.50.*coin.*2.00.*position/);
  const held = [...document.querySelectorAll(".pad .held")].map((key) => key.textContent);
  expect(held).toEqual(["W", "D"]);
  expect(asked("hand back")).toEqual(["hand_back"]);
});

it("says what is wrong with a level file, and where", () => {
  const wrong = { where: "plates.0.at", line: 12, text: "found a plate in the air" };
  const problems = { type: "problems" as const, file: "my.yaml", errors: [wrong], warnings: [] };
  show({ problems }, { mode: "watch" });
  expect(text(".problems")).toContain("my.yaml: 1 error");
  expect(text(".problems li")).toBe("errorline 12, plates.0.atfound a plate in the air");
  show({ problems: { ...problems, errors: [] } }, { mode: "watch" });
  expect(text(".problems")).toBe("my.yaml: all is well");
});

it("tells medals apart by shape and letter, and in words", () => {
  const medals = ["gold", "silver", "bronze"] as const;
  const levels = medals.map((medal, i) => fakeRow({ name: medal, number: i + 1, medal }));
  show({ frame: fakeFrame({ phase: "start" }) }, { levels });
  const cards = [...document.querySelectorAll(".card")];
  expect(cards.map((card) => card.querySelector("text")?.textContent)).toEqual(["G", "S", "B"]);
  const shapes = cards.map((card) => card.querySelector("path")?.getAttribute("d"));
  expect(new Set(shapes).size).toBe(3);
  expect(cards[0]?.getAttribute("aria-label")).toMatch(/^Level 1: Open floor, gold medal/);
});

it("mutes, and says of a lost connection that it tries again", () => {
  show({ connection: "lost" });
  expect(text(".cover")).toContain("connects again by itself");
  giveCommand("mute");
  expect(settings).toEqual({ muted: true });
});
