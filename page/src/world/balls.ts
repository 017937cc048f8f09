/** The ball, the ghost beside it, the crowd of others, and the shadow where the ball will land. */

import {
  CanvasTexture,
  CircleGeometry,
  Color,
  Group,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshStandardMaterial,
  NoColorSpace,
  Quaternion,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
} from "three";
import type { Frame } from "../types";
import { SimpleMaterial } from "./simple";
import type { Solids } from "./solids";

const RED = "#e63329";
const CREAM = "#f5f2eb";
const NAVY = "#213869";
const SEAM = "#2b2622";
const WEDGES = 6;
/** Sine of the latitude at which the caps begin. */
const CAP = 0.86;

const MAX_CROWD = 256;

/** Height over the ground at which the landing shadow is nearly gone. */
const SHADOW_REACH_M = 12;
const SHADOW_OPACITY = 0.6;
const ABOVE_GROUND_M = 0.012;

const Z = new Vector3(0, 0, 1);

export class Balls {
  readonly group = new Group();
  private readonly ball: Mesh<SphereGeometry, SimpleMaterial | MeshStandardMaterial>;
  private readonly pattern: CanvasTexture;
  private readonly ghost: Mesh<SphereGeometry, MeshLambertMaterial>;
  private readonly crowd: InstancedMesh<SphereGeometry, MeshLambertMaterial>;
  private readonly shadow: Mesh<CircleGeometry, MeshBasicMaterial>;
  private readonly matrix = new Matrix4();
  private readonly normal = new Vector3();
  private readonly turn = new Quaternion();

  /**
   * @param radius - of the ball, metres.
   * @param rich - whether light is worked out for each pixel and the sky is reflected.
   */
  constructor(
    private readonly radius: number,
    rich: boolean,
  ) {
    // Of three's sphere the poles are on y, of the ball on z.
    const sphere = new SphereGeometry(radius, 48, 32).rotateX(Math.PI / 2);
    this.pattern = beachBall();
    this.pattern.colorSpace = rich ? SRGBColorSpace : NoColorSpace;
    this.ball = new Mesh(
      sphere,
      rich
        ? new MeshStandardMaterial({ map: this.pattern, roughness: 0.28 })
        : new SimpleMaterial([1, 1, 1], 1, 0.1, this.pattern),
    );
    this.ball.castShadow = true;
    this.ghost = new Mesh(sphere, glassy("#d8ecff", 0.55));
    this.ghost.renderOrder = 2;
    const coarse = new SphereGeometry(radius, 20, 12);
    this.crowd = new InstancedMesh(coarse, glassy("#ffffff", 0.4), MAX_CROWD);
    this.crowd.frustumCulled = false;
    this.crowd.count = 0;
    this.crowd.renderOrder = 2;
    for (let i = 0; i < MAX_CROWD; i++) {
      // The golden ratio's turns keep neighbours' hues apart.
      this.crowd.setColorAt(i, new Color().setHSL((i * 0.618034) % 1, 0.75, 0.6));
    }
    this.shadow = new Mesh(
      new CircleGeometry(1, 32),
      new MeshBasicMaterial({
        map: softDisc(),
        color: 0x06101c,
        transparent: true,
        depthWrite: false,
        polygonOffset: true,
        polygonOffsetFactor: -2,
        polygonOffsetUnits: -2,
      }),
    );
    this.shadow.renderOrder = 1;
    this.group.add(this.ball, this.ghost, this.crowd, this.shadow);
  }

  /** Show a frame; `ballSeen` is false where one looks out of the ball. */
  show(frame: Frame, solids: Solids, ballSeen: boolean): void {
    const [w, x, y, z] = frame.orientation;
    this.ball.position.set(...frame.ball);
    this.ball.quaternion.set(x, y, z, w);
    this.ball.visible = ballSeen;
    this.ghost.visible = frame.ghost !== null;
    if (frame.ghost) this.ghost.position.set(...frame.ghost);
    this.showCrowd(frame.crowd);
    this.showShadow(solids);
  }

  dispose(): void {
    for (const mesh of [this.ball, this.ghost, this.crowd, this.shadow]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.pattern.dispose();
    this.shadow.material.map?.dispose();
    this.crowd.dispose();
  }

  private showCrowd(centres: Float32Array | null): void {
    const count = Math.min((centres?.length ?? 0) / 3, MAX_CROWD);
    this.crowd.count = count;
    this.crowd.visible = count > 0;
    if (centres === null) return;
    for (let i = 0; i < count; i++) {
      const [x = 0, y = 0, z = 0] = centres.subarray(3 * i, 3 * i + 3);
      this.crowd.setMatrixAt(i, this.matrix.makeTranslation(x, y, z));
    }
    this.crowd.instanceMatrix.needsUpdate = true;
  }

  /** Put the shadow on the ground straight below, larger and fainter the higher the ball is. */
  private showShadow(solids: Solids): void {
    const { position } = this.ball;
    const ground = solids.below(position);
    this.shadow.visible = ground !== null;
    if (ground === null) return;
    const height = Math.max(position.z - ground.height - this.radius, 0);
    const fade = Math.max(1 - height / SHADOW_REACH_M, 0.12);
    this.shadow.material.opacity = SHADOW_OPACITY * fade;
    this.shadow.scale.setScalar(this.radius * (1.25 + 0.1 * Math.min(height, SHADOW_REACH_M)));
    this.normal.copy(ground.normal);
    this.shadow.position
      .set(position.x, position.y, ground.height)
      .addScaledVector(this.normal, ABOVE_GROUND_M);
    this.shadow.quaternion.copy(this.turn.setFromUnitVectors(Z, this.normal));
  }
}

function glassy(colour: string, opacity: number): MeshLambertMaterial {
  return new MeshLambertMaterial({
    color: colour,
    emissive: colour,
    emissiveIntensity: 0.25,
    transparent: true,
    opacity,
    depthWrite: false,
  });
}

/** Paint the ball as if unrolled: wedges of two colours between caps, and dark seams. */
function beachBall(): CanvasTexture {
  const [width, height] = [1024, 512];
  const { canvas, context } = canvasOf(width, height);
  for (let wedge = 0; wedge < WEDGES; wedge++) {
    context.fillStyle = wedge % 2 === 0 ? RED : CREAM;
    context.fillRect((wedge * width) / WEDGES, 0, width / WEDGES + 1, height);
  }
  context.fillStyle = SEAM;
  for (let wedge = 0; wedge <= WEDGES; wedge++) {
    context.fillRect((wedge * width) / WEDGES - 5, 0, 10, height);
  }
  const cap = ((Math.PI / 2 - Math.asin(CAP)) / Math.PI) * height;
  for (const top of [0, height - cap]) {
    context.fillStyle = NAVY;
    context.fillRect(0, top, width, cap);
    context.fillStyle = SEAM;
    context.fillRect(0, top === 0 ? cap - 5 : top - 5, width, 10);
  }
  const texture = new CanvasTexture(canvas);
  texture.anisotropy = 4;
  return texture;
}

function softDisc(): CanvasTexture {
  const size = 128;
  const { canvas, context } = canvasOf(size, size);
  const gradient = context.createRadialGradient(
    size / 2,
    size / 2,
    0,
    size / 2,
    size / 2,
    size / 2,
  );
  for (const [at, opacity] of [
    [0, 1],
    [0.35, 0.85],
    [0.7, 0.3],
    [1, 0],
  ] as const) {
    gradient.addColorStop(at, `rgba(255, 255, 255, ${opacity})`);
  }
  context.fillStyle = gradient;
  context.fillRect(0, 0, size, size);
  return new CanvasTexture(canvas);
}

function canvasOf(
  width: number,
  height: number,
): { canvas: HTMLCanvasElement; context: CanvasRenderingContext2D } {
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("this browser paints no 2D canvas");
  return { canvas, context };
}
