/** Sound: what is heard of a game, found from what changes between one frame and the next. */

import type { Frame, Scene, Settings, Vec3 } from "./types";

export type SoundName = "coin" | "plate" | "gate" | "pad" | "landing" | "fall" | "finish";

/** A sound, and how loud it is, 0 to 1. */
export interface SoundEvent {
  sound: SoundName;
  gain: number;
}

const NAMES: readonly SoundName[] = ["coin", "plate", "gate", "pad", "landing", "fall", "finish"];

/** What is heard when a machine of a kind becomes active. */
const MACHINES: Readonly<Record<string, SoundName>> = {
  plate: "plate",
  switch: "plate",
  checkpoint: "plate",
  gate: "gate",
  lift_pad: "pad",
};
const ACTIVE = 1;

/** An impact below this is rolling, m/s. */
const SOFTEST = 1.2;
/** One above this is as loud as can be, m/s. */
const HARDEST = 9;
/** Speed that a ball changes by without any impact, m/s²: gravity and keys, generously. */
const WITHOUT_IMPACT = 25;
/** A ball that has moved on by more between two frames was taken somewhere else, m. */
const TAKEN_ELSEWHERE = 3;
/** The same sound is not begun again within this, s. */
const APART_S = 0.06;

/** Return what is heard of a frame after another. */
export function soundEvents(before: Frame | null, frame: Frame, scene: Scene): SoundEvent[] {
  if (before === null) return [];
  const events: SoundEvent[] = [];
  const hear = (sound: SoundName, gain = 1): void => {
    if (!events.some((one) => one.sound === sound)) events.push({ sound, gain });
  };
  if (frame.falls > before.falls) hear("fall");
  const follows = frame.episode === before.episode && frame.step > before.step;
  if (!follows) return events;
  if (frame.outcome === "finish" && before.outcome !== "finish") hear("finish");
  if (frame.coins > before.coins) hear("coin");
  scene.machines.forEach(({ kind }, machine) => {
    const sound = MACHINES[kind];
    const begins = frame.phases[machine] === ACTIVE && before.phases[machine] !== ACTIVE;
    if (sound !== undefined && begins) hear(sound);
  });
  const impact = impactOf(before, frame, scene);
  if (impact > 0) hear("landing", impact);
  return events;
}

/** Return how hard the ball has hit something, 0 to 1. */
function impactOf(before: Frame, frame: Frame, scene: Scene): number {
  const thrown = scene.machines.some(
    ({ kind }, machine) => kind === "lift_pad" && frame.phases[machine] === ACTIVE,
  );
  if (thrown || distance(before.ball, frame.ball) > TAKEN_ELSEWHERE) return 0;
  const gentle = WITHOUT_IMPACT * Math.max(frame.timeS - before.timeS, 0);
  const change = distance(before.velocity, frame.velocity) - gentle;
  return Math.min(Math.max((change - SOFTEST) / (HARDEST - SOFTEST), 0), 1);
}

function distance(one: Vec3, other: Vec3): number {
  return Math.hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]);
}

/** Plays the sounds. Browsers allow it only after a person has pressed something. */
export class Sound {
  private context: AudioContext | null = null;
  private volume: GainNode | null = null;
  private readonly buffers = new Map<SoundName, AudioBuffer>();
  private readonly begun = new Map<SoundName, number>();

  constructor() {
    const unlock = (): void => {
      for (const kind of ["pointerdown", "keydown"]) window.removeEventListener(kind, unlock);
      this.open();
    };
    for (const kind of ["pointerdown", "keydown"]) window.addEventListener(kind, unlock);
  }

  /**
   * Let be heard what has changed.
   *
   * @param before - the frame of the last call, null at first.
   * @param frame - the newest one.
   * @param scene - of its level.
   * @param settings - the volume.
   */
  update(before: Frame | null, frame: Frame, scene: Scene, settings: Settings): void {
    if (this.volume === null) return;
    // The ear hears the pressure's power, not the pressure.
    this.volume.gain.value = settings.muted ? 0 : settings.volume ** 2;
    if (settings.muted) return;
    for (const { sound, gain } of soundEvents(before, frame, scene)) this.play(sound, gain);
  }

  private play(sound: SoundName, gain: number): void {
    const { context, volume } = this;
    const buffer = this.buffers.get(sound);
    if (context === null || volume === null || buffer === undefined) return;
    const now = context.currentTime;
    if (now - (this.begun.get(sound) ?? -1) < APART_S) return;
    this.begun.set(sound, now);
    const [source, loudness] = [context.createBufferSource(), context.createGain()];
    source.buffer = buffer;
    loudness.gain.value = gain;
    source.connect(loudness).connect(volume);
    source.start();
  }

  private open(): void {
    if (typeof AudioContext === "undefined") return;
    this.context = new AudioContext();
    this.volume = this.context.createGain();
    this.volume.connect(this.context.destination);
    for (const name of NAMES) void this.load(name, this.context);
  }

  /** A page that was opened from a file has no sounds beside it, and is silent. */
  private async load(name: SoundName, context: AudioContext): Promise<void> {
    try {
      const answer = await fetch(`./sounds/${name}.wav`);
      if (!answer.ok) return;
      this.buffers.set(name, await context.decodeAudioData(await answer.arrayBuffer()));
    } catch (error) {
      console.info(`no sound ${name}: ${error}`);
    }
  }
}
