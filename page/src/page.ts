/** What the live page and a replay have in common: the world, panels, input, and what they see. */

import "./style.css";
import "./page.css";
import { Input } from "./input";
import { loadSettings, storeSettings } from "./settings";
import type { Actions, Frame, Scene, Settings, ToServer, View } from "./types";
import { Ui } from "./ui";
import { World } from "./world";
import { BEHIND, ORDER } from "./world/cameras/game";

const FPS_OVER_S = 0.5;

export class Page {
  readonly view: View = {
    hello: null,
    seat: "spectator",
    connection: "lost",
    frame: null,
    level: null,
    scene: null,
    result: null,
    timeline: null,
    agent: null,
    problems: null,
    notice: null,
    settings: loadSettings(),
    fps: 0,
  };
  private readonly canvas = document.createElement("canvas");
  private readonly world: World;
  private readonly ui: Ui;
  private readonly input: Input;
  private lowered: { of: Settings; low: Settings } | null = null;
  private readonly pictures = { count: 0, sinceS: 0 };

  /**
   * @param root - element that the page fills.
   * @param send - takes what a person asks for.
   * @param frameAt - returns the frame to draw at a time of the page's clock, seconds.
   */
  constructor(
    root: HTMLElement,
    send: (message: ToServer) => void,
    private readonly frameAt: (nowS: number) => Frame | null,
  ) {
    this.canvas.className = "world";
    this.canvas.setAttribute("aria-hidden", "true");
    root.append(this.canvas);
    this.world = new World(this.canvas);
    const actions: Actions = {
      send,
      setSettings: (change) => this.setSettings(change),
      nextCamera: () => this.setSettings({ camera: this.cameraAfter() }),
    };
    this.ui = new Ui(root, actions);
    this.input = new Input(root, actions, () => this.world.cameraYaw);
    new ResizeObserver(() => this.world.resize()).observe(this.canvas);
    requestAnimationFrame((ms) => this.tick(ms / 1000));
  }

  show(scene: Scene): void {
    this.view.scene = scene;
    this.world.load(scene);
  }

  private tick(nowS: number): void {
    requestAnimationFrame((ms) => this.tick(ms / 1000));
    const frame = this.frameAt(nowS);
    if (frame && this.view.scene) {
      const camera = this.world.draw(frame, this.drawn(), nowS);
      if (camera !== this.view.settings.camera) this.setSettings({ camera });
    }
    this.countPicture(nowS);
    this.input.update(this.view);
    this.ui.update(this.view);
  }

  /** Return the settings to draw with: the server may know that its players' machines are slow. */
  private drawn(): Settings {
    const { settings, hello } = this.view;
    if (settings.quality !== "auto" || hello?.quality !== "low") return settings;
    if (this.lowered?.of !== settings) {
      this.lowered = { of: settings, low: { ...settings, quality: "low" } };
    }
    return this.lowered.low;
  }

  private setSettings(change: Partial<Settings>): void {
    this.view.settings = { ...this.view.settings, ...change };
    storeSettings(this.view.settings);
  }

  /** Return the camera that comes next: the page's own two, and then the game's modes in order. */
  private cameraAfter(): Settings["camera"] {
    const { camera } = this.view.settings;
    if (camera === "follow") return "orbit";
    if (camera === "orbit") return "game";
    const mode = camera === "game" ? (this.view.frame?.cameraMode ?? BEHIND) : camera;
    return ORDER[ORDER.indexOf(mode) + 1] ?? "follow";
  }

  private countPicture(nowS: number): void {
    const { pictures } = this;
    pictures.count++;
    if (nowS - pictures.sinceS < FPS_OVER_S) return;
    this.view.fps = pictures.count / (nowS - pictures.sinceS);
    pictures.count = 0;
    pictures.sinceS = nowS;
  }
}

/** Begin in the element that the page goes into, or say there why that cannot be. */
export async function begin(page: (root: HTMLElement) => unknown): Promise<void> {
  const root = document.getElementById("app");
  if (root === null) throw new Error('the page has no element "app"');
  try {
    await page(root);
  } catch (error) {
    root.textContent = `Roller cannot be shown here: ${error instanceof Error ? error.message : error}`;
    throw error;
  }
}
