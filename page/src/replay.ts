/** A replay in a file of its own: states that were recorded, played without a server. */

import { between } from "./frames";
import { Page } from "./page";
import type { Frame, Phase, ResultMessage, Scene, ToServer } from "./types";
import { decodeFrame } from "./wire";

const POINTS_PER_COIN = 10;

/** What the HTML round this script has put there. */
export interface Recorded {
  /** base64 of gzip of the scene's JSON. */
  scene: string;
  /** base64 of gzip of frames, one after the other. */
  frames: string;
  frame_bytes: number;
  rate_hz: number;
  title: string;
  result: Pick<ResultMessage, "outcome" | "coins" | "time_s">;
}

declare global {
  interface Window {
    ROLLER?: Recorded;
  }
}

class Replay {
  private readonly page: Page;
  private readonly lastS: number;
  private readonly result: ResultMessage;
  private placeS = 0;
  private speed = 1;
  private playing = true;
  private shownAtS: number | null = null;
  private shownPlaceS = -1;

  constructor(
    root: HTMLElement,
    private readonly recorded: Recorded,
    scene: Scene,
    private readonly frames: readonly Frame[],
  ) {
    this.lastS = (frames.length - 1) / recorded.rate_hz;
    this.page = new Page(
      root,
      (message) => this.take(message),
      (nowS) => this.frameAt(nowS),
    );
    const { view } = this.page;
    view.hello = {
      type: "hello",
      format: 1,
      title: recorded.title,
      seat: "player",
      mode: "replay",
      physics: null,
      agent: null,
      levels: [],
      quality: "high",
      skip_intro: true,
    };
    view.seat = "player";
    view.connection = "open";
    const name = scene.name;
    view.level = {
      type: "level",
      name,
      scene: "",
      control_dt_s: 1 / recorded.rate_hz,
      points_per_coin: POINTS_PER_COIN,
      ghost: "none",
    };
    this.result = resultOf(recorded, scene);
    view.timeline = { type: "timeline", first_s: 0, last_s: this.lastS, can_branch: false };
    document.title = recorded.title;
    this.page.show(scene);
  }

  /** Play on for the time since the last call, and return the state there. */
  private frameAt(nowS: number): Frame {
    const elapsedS = this.shownAtS === null ? 0 : nowS - this.shownAtS;
    this.shownAtS = nowS;
    if (this.playing) this.go(this.placeS + this.speed * Math.max(elapsedS, 0));
    if (this.placeS === this.lastS) this.playing = false;
    const [phase, before] = [this.phase(), this.page.view.frame];
    const isShown = before?.phase === phase && before.speed === this.speed;
    if (isShown && this.placeS === this.shownPlaceS) return before;
    this.shownPlaceS = this.placeS;
    const frame = { ...this.frameOf(this.placeS), phase, speed: this.speed };
    this.page.view.frame = frame;
    this.page.view.result = phase === "ended" ? this.result : null;
    return frame;
  }

  private frameOf(placeS: number): Frame {
    const { frames } = this;
    const place = Math.min(placeS * this.recorded.rate_hz, frames.length - 1);
    const first = Math.floor(place);
    const before = frames[first] as Frame;
    return between(before, frames[first + 1] ?? before, place - first);
  }

  private phase(): Phase {
    if (this.playing) return "playing";
    return this.placeS === this.lastS ? "ended" : "paused";
  }

  private go(placeS: number): void {
    this.placeS = Math.min(Math.max(placeS, 0), this.lastS);
  }

  private take(message: ToServer): void {
    switch (message.type) {
      case "pause":
        this.playing = false;
        break;
      case "start":
      case "resume":
        if (this.placeS === this.lastS) this.go(0);
        this.playing = true;
        break;
      case "restart":
        this.go(0);
        this.playing = true;
        break;
      case "seek":
        this.go(message.time_s);
        break;
      case "speed":
        this.speed = message.factor;
        break;
      case "step":
        this.go(this.placeS + 1 / this.recorded.rate_hz);
    }
  }
}

function resultOf({ result }: Recorded, scene: Scene): ResultMessage {
  return {
    type: "result",
    ...result,
    coins_in_level: scene.coins,
    score_percent: scene.coins > 0 ? (100 * result.coins) / scene.coins : 0,
    points: POINTS_PER_COIN * result.coins,
    medal: null,
    best_time: false,
    best_coins: false,
    counts: false,
    next: null,
  };
}

async function unpack(base64: string): Promise<ArrayBuffer> {
  const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(unpacked).arrayBuffer();
}

/** Unpack a replay, and play it in an element. */
export async function openReplay(root: HTMLElement, recorded: Recorded): Promise<void> {
  const scene = JSON.parse(new TextDecoder().decode(await unpack(recorded.scene))) as Scene;
  const data = await unpack(recorded.frames);
  const count = Math.floor(data.byteLength / recorded.frame_bytes);
  if (count === 0) throw new Error("the replay in this file has no frames");
  const frames = Array.from({ length: count }, (_, i) =>
    decodeFrame(new DataView(data, i * recorded.frame_bytes, recorded.frame_bytes), scene.coins),
  );
  new Replay(root, recorded, scene, frames);
}
