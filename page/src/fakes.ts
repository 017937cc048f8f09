/** Views and frames for tests, and a page of its own for each. */

import { afterEach, vi } from "vitest";
import type { Frame, Hello, LevelRow, Scene, View } from "./types";

export function fakeFrame(change: Partial<Frame> = {}): Frame {
  return {
    phase: "playing",
    hasAgent: false,
    agentPlays: false,
    recording: false,
    rewound: false,
    cameraMode: 0,
    episode: 0,
    step: 0,
    timeS: 0,
    clockS: 0,
    keysInS: 0,
    coins: 0,
    keys: "",
    outcome: "none",
    ball: [0, 0, 0],
    orientation: [1, 0, 0, 0],
    velocity: [0, 0, 0],
    totalReward: 0,
    speed: 1,
    ghost: null,
    falls: 0,
    displacements: new Float32Array(),
    phases: new Uint8Array(),
    taken: new Uint8Array(),
    crowd: null,
    ...change,
  };
}

export function fakeScene(change: Partial<Scene> = {}): Scene {
  return {
    format: 1,
    name: "flat",
    title: "Open floor",
    description: "A floor.",
    hash: "0",
    par_time_s: 20,
    coins: 12,
    ball_radius: 0.4,
    start: [0, 0, 0],
    low: [0, 0, 0],
    high: [1, 1, 1],
    materials: {},
    paints: {},
    surfaces: [],
    ground: [],
    movers: [],
    shapes: [],
    machines: [],
    labels: [],
    ...change,
  };
}

export function fakeRow(change: Partial<LevelRow> = {}): LevelRow {
  return {
    name: "flat",
    title: "Open floor",
    description: "A floor.",
    number: 1,
    coins: 12,
    par_time_s: 20,
    picture: null,
    medal: null,
    best_time_s: null,
    best_coins: null,
    attempts: 0,
    ...change,
  };
}

export function fakeView(change: Partial<View> = {}, hello: Partial<Hello> = {}): View {
  return {
    hello: {
      type: "hello",
      format: 1,
      title: "Roller",
      seat: "player",
      mode: "play",
      physics: "default",
      agent: null,
      levels: [fakeRow(), fakeRow({ name: "ice", title: "Thin ice", number: 2 })],
      quality: "high",
      skip_intro: false,
      ...hello,
    },
    seat: "player",
    connection: "open",
    frame: fakeFrame(),
    level: {
      type: "level",
      name: "flat",
      scene: "",
      control_dt_s: 1 / 240,
      points_per_coin: 10,
      ghost: "none",
    },
    scene: fakeScene(),
    result: null,
    timeline: null,
    agent: null,
    problems: null,
    notice: null,
    settings: {
      keys: "world",
      camera: "follow",
      quality: "auto",
      volume: 0.7,
      muted: false,
      speedLabels: false,
    },
    fps: 60,
    ...change,
  };
}

/** Clear the page after each test, and what was listened to on its window. */
export function clearPages(): void {
  const listening = vi.spyOn(window, "addEventListener");
  afterEach(() => {
    for (const [kind, heard] of listening.mock.calls) window.removeEventListener(kind, heard);
    listening.mockClear();
    document.body.replaceChildren();
  });
}
