/** The codec of what goes over the WebSocket: frames in binary, messages in JSON. */

import type { Frame, FromServer, Outcome, Phase, Quat, ToServer, Vec3 } from "./types";

const FORMAT = 1;
const HEADER_BYTES = 96;

const PHASES: readonly Phase[] = ["start", "intro", "playing", "paused", "ended"];
const OUTCOMES: readonly Outcome[] = ["none", "finish", "fall", "diverged", "time limit"];

/** Letters of the keys, in order of their bits. */
export const KEYS = "wasd";

const HAS_AGENT = 1;
const AGENT_PLAYS = 2;
const RECORDING = 4;
const HAS_GHOST = 8;
const REWOUND = 16;

const METRES_PER_CROWD_UNIT = 0.01;

/**
 * Return what the bytes of a frame say.
 *
 * @param data - one binary message.
 * @param coinsInLevel - how many coins the scene has.
 * @throws RangeError if it is of another format or not of the length that it says.
 */
export function decodeFrame(data: ArrayBuffer | ArrayBufferView, coinsInLevel: number): Frame {
  const view = ArrayBuffer.isView(data)
    ? new DataView(data.buffer, data.byteOffset, data.byteLength)
    : new DataView(data);
  if (view.byteLength < HEADER_BYTES || view.getUint8(0) !== FORMAT) {
    throw new RangeError(`not a frame of format ${FORMAT}: ${view.byteLength} bytes`);
  }
  const flags = view.getUint8(2);
  const numbers = (offset: number, count: number) =>
    Array.from({ length: count }, (_, i) => view.getFloat32(offset + 4 * i, true));
  const movers = view.getUint8(94);
  const machines = view.getUint8(95);
  const phasesAt = HEADER_BYTES + 4 * movers;
  const takenAt = phasesAt + machines;
  const crowdAt = takenAt + Math.ceil(coinsInLevel / 8);
  if (view.byteLength < crowdAt) {
    throw new RangeError(`a frame of ${view.byteLength} bytes where ${crowdAt} are due`);
  }
  return {
    phase: PHASES[view.getUint8(1)] ?? "start",
    hasAgent: (flags & HAS_AGENT) !== 0,
    agentPlays: (flags & AGENT_PLAYS) !== 0,
    recording: (flags & RECORDING) !== 0,
    rewound: (flags & REWOUND) !== 0,
    cameraMode: view.getUint8(3),
    episode: view.getUint32(4, true),
    step: view.getUint32(8, true),
    timeS: view.getFloat32(12, true),
    clockS: view.getFloat64(16, true),
    keysInS: view.getFloat32(24, true),
    coins: view.getUint16(28, true),
    keys: [...KEYS].filter((_, bit) => view.getUint8(30) & (1 << bit)).join(""),
    outcome: OUTCOMES[view.getUint8(31)] ?? "none",
    ball: numbers(32, 3) as unknown as Vec3,
    orientation: numbers(44, 4) as unknown as Quat,
    velocity: numbers(60, 3) as unknown as Vec3,
    totalReward: view.getFloat32(72, true),
    speed: view.getFloat32(76, true),
    ghost: flags & HAS_GHOST ? (numbers(80, 3) as unknown as Vec3) : null,
    falls: view.getUint16(92, true),
    displacements: Float32Array.from(numbers(HEADER_BYTES, movers)),
    phases: bytes(view, phasesAt, machines),
    taken: bytes(view, takenAt, crowdAt - takenAt),
    crowd: view.byteLength > crowdAt ? decodeCrowd(view, crowdAt) : null,
  };
}

/** Return whether a coin is taken. */
export function isTaken(frame: Frame, coin: number): boolean {
  return (((frame.taken[coin >> 3] ?? 0) >> (coin & 7)) & 1) === 1;
}

/** Return what a text message says, or null if it is of no kind that the page knows. */
export function decodeMessage(text: string): FromServer | null {
  const message: unknown = JSON.parse(text);
  const known = typeof message === "object" && message !== null && "type" in message;
  return known ? (message as FromServer) : null;
}

/** Return the text of a message. */
export function encodeMessage(message: ToServer): string {
  return JSON.stringify(message);
}

function bytes(view: DataView, offset: number, count: number): Uint8Array {
  return new Uint8Array(view.buffer, view.byteOffset + offset, count).slice();
}

function decodeCrowd(view: DataView, offset: number): Float32Array {
  const count = view.getUint16(offset, true);
  if (view.byteLength !== offset + 2 + 6 * count) {
    throw new RangeError(`a crowd of ${count} in a frame of ${view.byteLength} bytes`);
  }
  const centres = new Float32Array(3 * count);
  for (let i = 0; i < centres.length; i++) {
    centres[i] = METRES_PER_CROWD_UNIT * view.getInt16(offset + 2 + 2 * i, true);
  }
  return centres;
}
