/** The world: what a scene looks like in the state of a frame, drawn on a canvas. */

import {
  AmbientLight,
  DirectionalLight,
  HemisphereLight,
  Matrix4,
  PCFShadowMap,
  PerspectiveCamera,
  PMREMGenerator,
  Quaternion,
  Vector3,
  WebGLRenderer,
  type WebGLRenderTarget,
  Scene as World3,
} from "three";
import { goesOn } from "../frames";
import type { Frame, Scene, Settings } from "../types";
import { Balls } from "./balls";
import { type Eye, newEye, yawOf } from "./cameras/eye";
import { FollowCamera } from "./cameras/follow";
import { BELOW, FIRST_PERSON, GameCamera } from "./cameras/game";
import { OrbitCamera } from "./cameras/orbit";
import { Labels } from "./labels";
import { Paints } from "./paint";
import { Quality } from "./quality";
import { Scenery } from "./scenery";
import { paintSky, skyMesh } from "./sky";
import { Solids } from "./solids";

export type CameraChoice = Settings["camera"];

/** Of the height of the picture, as in the game's own pictures; wide enough upright, too. */
const FIELD_OF_VIEW = 65;
const LEAST_WIDTH_OF_VIEW = 60;

const SUN = new Vector3(0.42, -0.3, -0.86).normalize();
const TOWARDS_SUN = SUN.clone().negate();
const SUN_DISTANCE_M = 30;
/** From the frame of who looks from the sun, as its shadow's camera does, to the world's. */
const FROM_SUN = new Quaternion().setFromRotationMatrix(
  new Matrix4().lookAt(TOWARDS_SUN, new Vector3(), new Vector3(0, 1, 0)),
);
const TO_SUN = FROM_SUN.clone().invert();
/** Half edge of the square round the ball in which the sun casts shadows. */
const SHADOW_REACH_M = 14;
const SHADOW_PIXELS = 2048;

/** How much of the sky is reflected. */
const ENVIRONMENT_SHARE = 0.45;

/** With no graphics card more pictures a second would take the game its processor. */
const SOFTWARE_FRAME_S = 1 / 31;

/** The last picture. */
interface Drawn {
  frame: Frame;
  settings: Settings;
  atS: number;
}

export class World {
  private readonly renderer: WebGLRenderer;
  private readonly world = new World3();
  private readonly camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.1, 1000);
  private readonly sun = new DirectionalLight("#fff1dc", 2.5);
  private readonly skyLight = new HemisphereLight("#e9f1ff", "#a8b4c4");
  private environment: WebGLRenderTarget | null = null;
  private readonly software: boolean;
  private readonly quality: Quality;
  private readonly game = new GameCamera();
  private readonly follow = new FollowCamera();
  private readonly orbit: OrbitCamera;
  private readonly eye: Eye = newEye();
  private choice: CameraChoice = "follow";
  private dragged = false;
  private cutNext = true;
  private scene: Scene | null = null;
  private parts: Parts | null = null;
  private drawn: Drawn | null = null;

  /** @throws Error if the browser has no WebGL 2. */
  constructor(private readonly canvas: HTMLCanvasElement) {
    this.software = drawsInSoftware();
    this.quality = new Quality(this.software);
    this.renderer = new WebGLRenderer({
      canvas,
      antialias: !this.software,
      powerPreference: "high-performance",
    });
    this.renderer.shadowMap.type = PCFShadowMap;
    this.camera.up.set(0, 0, 1);
    this.setSun();
    this.world.add(skyMesh(paintSky(this.renderer, TOWARDS_SUN, false)));
    this.skyLight.position.set(0, 0, 1);
    this.world.add(this.sun, this.sun.target, this.skyLight, new AmbientLight("#ffffff", 0.35));
    this.orbit = new OrbitCamera(
      canvas,
      () => {
        this.dragged = true;
      },
      () => this.choice === "orbit",
    );
    // What the graphics card has forgotten, a new page paints again.
    canvas.addEventListener("webglcontextrestored", () => location.reload());
    this.resize();
  }

  /** Direction in the plane that the camera looks in, radians from +x towards +y. */
  get cameraYaw(): number {
    return yawOf(this.eye);
  }

  /** Show another scene. */
  load(scene: Scene): void {
    this.scene = scene;
    this.quality.retry();
    this.resize();
    this.build(scene);
    this.game.reset();
    this.cutNext = true;
    this.drawn = null;
  }

  /** Take the canvas's size on the page. */
  resize(): void {
    const width = Math.max(this.canvas.clientWidth, 1);
    const height = Math.max(this.canvas.clientHeight, 1);
    this.renderer.setPixelRatio(this.quality.pixelRatio(width, height, window.devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    const least = Math.tan((LEAST_WIDTH_OF_VIEW * Math.PI) / 360) / this.camera.aspect;
    this.camera.fov = Math.max(FIELD_OF_VIEW, (Math.atan(least) * 360) / Math.PI);
    this.camera.updateProjectionMatrix();
    this.drawn = null;
  }

  /**
   * Draw a frame.
   *
   * @param frame - the state to draw, as a rule one between two that came.
   * @param settings - whose camera and quality are heeded.
   * @param nowS - time of the page's clock, seconds.
   * @returns the camera in force: another than the settings' if a mouse has begun to turn it, or if
   *   the game has changed the mode that a person had chosen.
   */
  draw(frame: Frame, settings: Settings, nowS: number): CameraChoice {
    if (this.parts === null) return settings.camera;
    const { drawn } = this;
    const elapsedS = drawn ? Math.max(nowS - drawn.atS, 0) : 0;
    if (this.software && drawn && this.canWait(drawn, frame, settings, elapsedS)) {
      return settings.camera;
    }
    this.adapt(settings, elapsedS);
    if (this.cutNext || (drawn && !goesOn(drawn.frame, frame))) this.follow.cut(frame);
    this.cutNext = false;
    const choice = this.look(frame, settings.camera, elapsedS);
    this.drawn = { frame, settings, atS: nowS };
    const { scenery, balls, labels, solids } = this.parts;
    const mode = typeof choice === "number" || choice === "game" ? this.game.mode : -1;
    scenery.setSeenFromBelow(mode === BELOW);
    scenery.show(frame);
    balls.show(frame, solids, mode !== FIRST_PERSON);
    labels.group.visible = settings.speedLabels;
    this.light(frame);
    this.renderer.render(this.world, this.camera);
    return choice;
  }

  /** Return whether a picture may be left out: the processor that would draw it is the game's, too. */
  private canWait(drawn: Drawn, frame: Frame, settings: Settings, elapsedS: number): boolean {
    if (elapsedS < SOFTWARE_FRAME_S) return true;
    const isTurned = this.dragged || settings.camera === "orbit";
    return frame === drawn.frame && settings === drawn.settings && !isTurned;
  }

  private look(frame: Frame, wanted: CameraChoice, elapsedS: number): CameraChoice {
    const { eye, parts } = this;
    if (parts === null) return wanted;
    parts.solids.show(frame);
    const choice = this.dragged ? "orbit" : wanted;
    this.dragged = false;
    if (choice === "orbit" && this.choice !== "orbit") this.orbit.from(eye);
    this.choice = choice;
    const chosen = typeof choice === "number" ? choice : null;
    // It moves on, seen or not: its retreat is in time.
    const gameS = frame.phase === "paused" ? 0 : elapsedS * frame.speed;
    const holds = this.game.look(frame, chosen, gameS, eye);
    if (choice === "follow") this.follow.look(frame, parts.solids, gameS, eye);
    if (choice === "orbit") this.orbit.look(frame, parts.solids, eye);
    if (!holds) this.choice = "game";
    else if (chosen !== null) this.choice = this.game.mode;
    this.camera.position.copy(eye.position);
    this.camera.lookAt(eye.target);
    return this.choice;
  }

  /** Spend as much on pictures as quality allows. */
  private adapt(settings: Settings, elapsedS: number): void {
    const before = this.quality.effort;
    this.quality.choose(settings.quality);
    if (elapsedS > 0) this.quality.took(elapsedS);
    const { effort } = this.quality;
    if (effort.rich !== before.rich && this.scene) this.build(this.scene);
    if (effort !== before) this.resize();
  }

  private build(scene: Scene): void {
    this.parts?.dispose();
    const { rich } = this.quality.effort;
    // Without a graphics card it takes ten seconds to get ready.
    const reflects = rich && !this.software;
    if (reflects && this.environment === null) {
      const sky = paintSky(this.renderer, TOWARDS_SUN, true);
      const generator = new PMREMGenerator(this.renderer);
      this.environment = generator.fromCubemap(sky.texture);
      generator.dispose();
      sky.dispose();
    }
    this.world.environmentIntensity = ENVIRONMENT_SHARE;
    this.world.environment = reflects ? (this.environment?.texture ?? null) : null;
    this.skyLight.intensity = reflects ? 1 : 1.7;
    this.renderer.shadowMap.enabled = rich;
    this.sun.castShadow = rich;
    const anisotropy = rich ? Math.min(this.renderer.capabilities.getMaxAnisotropy(), 8) : 1;
    this.parts = new Parts(scene, rich, anisotropy, this.world);
  }

  private setSun(): void {
    const { shadow } = this.sun;
    shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
    shadow.bias = -0.0004;
    shadow.normalBias = 0.02;
    shadow.radius = 3;
    Object.assign(shadow.camera, {
      left: -SHADOW_REACH_M,
      right: SHADOW_REACH_M,
      top: SHADOW_REACH_M,
      bottom: -SHADOW_REACH_M,
      near: 1,
      far: 3 * SUN_DISTANCE_M,
    });
  }

  /** Let the sun cast its shadows round the ball. */
  private light(frame: Frame): void {
    const texel = (2 * SHADOW_REACH_M) / SHADOW_PIXELS;
    const { position: middle } = this.sun.target;
    // By whole texels as the sun sees them, or edges of shadows would crawl.
    middle.set(...frame.ball).applyQuaternion(TO_SUN);
    middle.x = Math.round(middle.x / texel) * texel;
    middle.y = Math.round(middle.y / texel) * texel;
    middle.applyQuaternion(FROM_SUN);
    this.sun.position.copy(middle).addScaledVector(TOWARDS_SUN, SUN_DISTANCE_M);
  }
}

/** What belongs to one scene. */
class Parts {
  readonly paints: Paints;
  readonly scenery: Scenery;
  readonly balls: Balls;
  readonly labels: Labels;
  readonly solids: Solids;

  constructor(
    scene: Scene,
    rich: boolean,
    anisotropy: number,
    private readonly world: World3,
  ) {
    this.paints = new Paints(scene, rich, anisotropy);
    this.scenery = new Scenery(scene, this.paints);
    this.balls = new Balls(scene.ball_radius, rich);
    this.labels = new Labels(scene);
    this.solids = new Solids(scene);
    world.add(this.scenery.group, this.balls.group, this.labels.group);
  }

  dispose(): void {
    this.world.remove(this.scenery.group, this.balls.group, this.labels.group);
    this.scenery.dispose();
    this.balls.dispose();
    this.labels.dispose();
    this.paints.dispose();
  }
}

/** Return whether the browser draws without a graphics card. */
function drawsInSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  if (context === null) throw new Error("this browser draws no WebGL 2");
  const info = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(context.getParameter(info?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER));
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}
