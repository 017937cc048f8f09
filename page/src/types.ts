/**
 * What goes over the wire, and what the page's parts tell each other.
 *
 * Names of fields in JSON are the server's. Lengths are metres, times seconds, in the world's frame:
 * x forward (W), y left (A), z up.
 */

export type Vec3 = readonly [number, number, number];

/** w, x, y, z; of unit length. */
export type Quat = readonly [number, number, number, number];

// ---------------------------------------------------------------------------------------- scene

export interface Material {
  /** #rrggbb or #rrggbbaa */
  colour: string;
  pattern: "checker" | "grid" | "plain";
}

export interface Paint {
  colour: string;
  /** Share of the colour that is seen without any light. */
  emission: number;
  specular: number;
  shininess: number;
  /** Of a body as a whole; 1 leaves the colour's alpha. */
  opacity: number;
  texture: "" | "chequers";
}

/** Triangles, in base64 of little endian numbers. */
export interface SurfaceData {
  /** float32, n * 3 */
  vertices: string;
  /** float32, n * 3 */
  normals: string;
  /** float32, n * 2, in repetitions of a tile of two by two checks */
  texture: string;
  /** uint32, m * 3 */
  faces: string;
}

export interface GroundPart {
  surface: number;
  material: string;
  /** An edge is the side of a slab: its v runs down from the bright rim. */
  part: "face" | "edge";
}

export interface MoverData {
  name: string;
  /** It is at its place plus its displacement times this. */
  along: Vec3;
}

export type Motion =
  | { kind: "spin"; turns_per_s: number; bob_m: number; bobs_per_s: number; phase: number }
  | { kind: "run"; way: Vec3; speed: number; ahead: number }
  | {
      kind: "fly";
      number: number;
      every_s: number;
      speed: number;
      width: number;
      life_s: number;
    };

export interface Shape {
  /** A number is an index of surfaces. */
  form: "box" | "cylinder" | "sphere" | number;
  /** Half edges; radius and half height; radius. */
  size: readonly number[];
  at: Vec3;
  rotation: Quat;
  /** Names of paints by phase of its machine, the last one also for later phases; or a material. */
  look: readonly string[];
  is_material: boolean;
  /** Index of the mover that carries it, or -1. */
  mover: number;
  /** Index of the machine whose phase decides its look, or -1. */
  machine: number;
  /** Index of the coin that it shows, or -1. */
  coin: number;
  /** Phases of the machine in which it is seen. */
  seen_in: readonly number[];
  motion: Motion | null;
}

export interface Scene {
  format: 1;
  name: string;
  title: string;
  description: string;
  hash: string;
  par_time_s: number | null;
  /** How many there are. */
  coins: number;
  ball_radius: number;
  start: Vec3;
  /** Corners of the box round all solids. */
  low: Vec3;
  high: Vec3;
  materials: Readonly<Record<string, Material>>;
  paints: Readonly<Record<string, Paint>>;
  surfaces: readonly SurfaceData[];
  ground: readonly GroundPart[];
  movers: readonly MoverData[];
  shapes: readonly Shape[];
  machines: readonly { kind: string; name: string }[];
  labels: readonly { text: string; at: Vec3 }[];
}

// --------------------------------------------------------------------------------------- frames

export type Phase = "start" | "intro" | "playing" | "paused" | "ended";

export type Outcome = "none" | "finish" | "fall" | "diverged" | "time limit";

/** The state of the game at one moment. */
export interface Frame {
  phase: Phase;
  hasAgent: boolean;
  agentPlays: boolean;
  recording: boolean;
  /** Does not count for records. */
  rewound: boolean;
  /** Mode that the game asks for, 0 to 5. */
  cameraMode: number;
  /** From 0. */
  episode: number;
  /** Control steps since the episode began. */
  step: number;
  /** Seconds since the episode began. */
  timeS: number;
  /** Seconds of the scenery, which stands still in a pause. */
  clockS: number;
  /** Seconds until the keys work. */
  keysInS: number;
  /** Collected. */
  coins: number;
  /** Keys that push now: letters of "wasd", world axes. */
  keys: string;
  outcome: Outcome;
  ball: Vec3;
  orientation: Quat;
  /** m/s */
  velocity: Vec3;
  totalReward: number;
  /** Of time: 1 is normal, 0.25 slow motion. */
  speed: number;
  ghost: Vec3 | null;
  /** Of this session. */
  falls: number;
  /** Of each mover, metres along its way. */
  displacements: Float32Array;
  /** Of each machine: 0 idle, 1 active, 2 done. */
  phases: Uint8Array;
  /** Of each coin, whether it is taken: bits, see `isTaken` of wire.ts. */
  taken: Uint8Array;
  /** Centres of other balls, three numbers each. */
  crowd: Float32Array | null;
}

// ------------------------------------------------------------------------------- server to page

export type Seat = "player" | "spectator";

export type Medal = "gold" | "silver" | "bronze";

export interface LevelRow {
  name: string;
  title: string;
  description: string;
  /** Place in order of difficulty, from 1; 0 for a file of one's own. */
  number: number;
  coins: number;
  par_time_s: number | null;
  picture: string | null;
  medal: Medal | null;
  best_time_s: number | null;
  best_coins: number | null;
  attempts: number;
}

export interface Hello {
  type: "hello";
  format: 1;
  title: string;
  seat: Seat;
  mode: "play" | "replay" | "watch";
  physics: string | null;
  agent: string | null;
  levels: readonly LevelRow[];
  quality: "high" | "low";
  skip_intro: boolean;
}

export interface LevelMessage {
  type: "level";
  name: string;
  /** Address of the scene. */
  scene: string;
  control_dt_s: number;
  points_per_coin: number;
  /** Against whom one races. */
  ghost: "none" | "best" | "par";
}

export interface SeatMessage {
  type: "seat";
  seat: Seat;
}

export interface LevelsMessage {
  type: "levels";
  levels: readonly LevelRow[];
}

export interface ResultMessage {
  type: "result";
  outcome: Exclude<Outcome, "none">;
  coins: number;
  coins_in_level: number;
  score_percent: number;
  time_s: number;
  points: number;
  medal: Medal | null;
  best_time: boolean;
  best_coins: boolean;
  counts: boolean;
  next: string | null;
}

export interface TimelineMessage {
  type: "timeline";
  first_s: number;
  last_s: number;
  can_branch: boolean;
}

export interface AgentMessage {
  type: "agent";
  actions: readonly string[];
  probabilities: readonly number[] | null;
  value: number | null;
  entries: readonly { name: string; value: readonly number[] }[];
  reward_terms: Readonly<Record<string, number>>;
}

export interface Problem {
  where: string;
  line: number | null;
  text: string;
}

export interface ProblemsMessage {
  type: "problems";
  file: string;
  errors: readonly Problem[];
  warnings: readonly Problem[];
}

export interface NoticeMessage {
  type: "notice";
  text: string;
}

export type FromServer =
  | Hello
  | LevelMessage
  | SeatMessage
  | LevelsMessage
  | ResultMessage
  | TimelineMessage
  | AgentMessage
  | ProblemsMessage
  | NoticeMessage;

// ------------------------------------------------------------------------------- page to server

export type ToServer =
  | { type: "keys"; held: string }
  | {
      type:
        | "start"
        | "restart"
        | "pause"
        | "resume"
        | "hand_back"
        | "next"
        | "menu"
        | "step"
        | "skip"
        | "ask_seat"
        | "leave_seat";
    }
  | { type: "choose"; level: string }
  | { type: "seek"; time_s: number }
  | { type: "speed"; factor: number }
  | { type: "ghost"; kind: "none" | "best" | "par" };

// ------------------------------------------------------------------------------ within the page

export interface Settings {
  /** What the keys are relative to. */
  keys: "world" | "camera";
  /** A number is a mode of the game's camera, 0 to 5, that a person has chosen. */
  camera: "game" | "follow" | "orbit" | number;
  quality: "high" | "low" | "auto";
  /** 0 to 1 */
  volume: number;
  muted: boolean;
  speedLabels: boolean;
}

/** All that panels, input and sound may look at. */
export interface View {
  hello: Hello | null;
  seat: Seat;
  connection: "open" | "lost";
  /** The newest frame, not the one drawn between two. */
  frame: Frame | null;
  level: LevelMessage | null;
  /** Null while it is being fetched. */
  scene: Scene | null;
  result: ResultMessage | null;
  timeline: TimelineMessage | null;
  agent: AgentMessage | null;
  problems: ProblemsMessage | null;
  notice: string | null;
  settings: Settings;
  fps: number;
}

/** What panels and input may do. */
export interface Actions {
  send(message: ToServer): void;
  setSettings(change: Partial<Settings>): void;
  nextCamera(): void;
}
