/** What tests share. */

import type { Frame, Scene } from "./types";

/** Return a frame of a game that has just begun, but for what is given. */
export function frameOf(change: Partial<Frame> = {}): Frame {
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

/** Return a scene of which nothing is seen, but for what is given. */
export function sceneOf(change: Partial<Scene> = {}): Scene {
  return {
    format: 1,
    name: "test",
    title: "Test",
    description: "",
    hash: "",
    par_time_s: null,
    coins: 0,
    ball_radius: 0.4,
    start: [0, 0, 0],
    low: [0, 0, 0],
    high: [1, 1, 1],
    materials: { deck: { colour: "#808080", pattern: "plain" } },
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
