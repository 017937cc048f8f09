/** The live page: a game on a server, played and watched here. */

import { Connection, type Listener, socketAddress } from "./connection";
import { FrameBuffer } from "./frames";
import { Page } from "./page";
import { Sound } from "./sound";
import type { Frame, FromServer, LevelMessage, Scene } from "./types";
import { decodeFrame } from "./wire";

const NOTICE_MS = 6000;

export class Live implements Listener {
  private readonly frames = new FrameBuffer();
  private readonly sound = new Sound();
  private readonly page: Page;
  private readonly connection: Connection;
  /** Of the result that was told; null until a frame has come after it. */
  private resultOfEpisode: number | null = null;
  private noticeTimer = 0;

  constructor(root: HTMLElement) {
    this.page = new Page(
      root,
      (message) => this.connection.send(message),
      (nowS) => this.frames.sample(nowS),
    );
    this.connection = new Connection(socketAddress(location.href), this);
  }

  opened(): void {
    this.page.view.connection = "open";
  }

  lost(): void {
    this.page.view.connection = "lost";
  }

  framed(data: ArrayBuffer): void {
    const { view } = this.page;
    // Frames fit the level that was told of last; until its scene is here nothing is drawn.
    if (view.scene === null) return;
    const frame = decodeFrame(data, view.scene.coins);
    const before = view.frame;
    view.frame = frame;
    this.frames.push(frame);
    this.forget(before, frame);
    this.sound.update(before, frame, view.scene, view.settings);
  }

  told(message: FromServer): void {
    const { view } = this.page;
    switch (message.type) {
      case "hello":
        view.hello = message;
        view.seat = message.seat;
        document.title = message.title;
        break;
      case "level":
        this.load(message).catch((error: Error) => this.notice(`No level: ${error.message}`));
        break;
      case "seat":
        view.seat = message.seat;
        break;
      case "levels":
        if (view.hello) view.hello = { ...view.hello, levels: message.levels };
        break;
      case "result":
        view.result = message;
        this.resultOfEpisode = view.frame?.episode ?? null;
        break;
      case "timeline":
        view.timeline = message;
        break;
      case "agent":
        view.agent = message;
        break;
      case "problems":
        view.problems = message;
        break;
      case "notice":
        this.notice(message.text);
    }
  }

  private notice(text: string): void {
    const { view } = this.page;
    view.notice = text;
    clearTimeout(this.noticeTimer);
    this.noticeTimer = window.setTimeout(() => {
      view.notice = null;
    }, NOTICE_MS);
  }

  private async load(level: LevelMessage): Promise<void> {
    const { view } = this.page;
    const known = view.level?.scene === level.scene ? view.scene : null;
    view.level = level;
    view.scene = view.frame = view.result = view.timeline = view.agent = null;
    this.frames.clear();
    const scene = known ?? (await fetchScene(level.scene));
    if (view.level === level) this.page.show(scene);
  }

  /** Drop what was told of a game or a pause that is over. */
  private forget(before: Frame | null, frame: Frame): void {
    const { view } = this.page;
    if (view.result) this.resultOfEpisode ??= frame.episode;
    if (frame.episode !== this.resultOfEpisode || frame.phase === "start") view.result = null;
    const goesOn = before?.phase === "paused" && frame.phase !== "paused";
    if (goesOn && view.hello?.mode !== "replay") view.timeline = null;
    if (!frame.hasAgent) view.agent = null;
  }
}

async function fetchScene(address: string): Promise<Scene> {
  const response = await fetch(address);
  if (!response.ok) throw new Error(`${address}: ${response.status} ${response.statusText}`);
  return (await response.json()) as Scene;
}
