/**
 * All of a level that is drawn, but for balls and sky.
 *
 * What never changes is one mesh for each material. Everything else is instances, one batch for
 * each form and paint: a frame moves them, and hides what is not seen then. Nothing is remembered:
 * the same frame always gives the same picture.
 */

import {
  type BufferGeometry,
  DynamicDrawUsage,
  Group,
  InstancedMesh,
  type Material,
  Matrix4,
  Mesh,
  Quaternion,
  Vector3,
} from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import type { Frame, Motion, Scene, Shape, Vec3 } from "../types";
import { isTaken } from "../wire";
import { Flares, MAX_FLARES } from "./flares";
import { Forms, placeOf, quaternionOf, scaleOf } from "./geometry";
import { Glows } from "./glow";
import { type Paints, parseColour } from "./paint";

/** Of the ground while it is looked at from below, where it would hide all. */
const SEEN_FROM_BELOW = 0.35;

const UP = new Vector3(0, 0, 1);
const HIDDEN = new Matrix4().makeScale(0, 0, 0);

export class Scenery {
  readonly group = new Group();
  private readonly forms: Forms;
  private readonly batches = new Map<string, Batch>();
  private readonly changing: Changing[] = [];
  private readonly flying: Shape[] = [];
  private readonly flares: Flares;
  private readonly glows: Glows;
  private readonly ground = new Set<Material>();

  constructor(
    private readonly scene: Scene,
    private readonly paints: Paints,
  ) {
    this.forms = new Forms(scene);
    const still = new Map<Material, BufferGeometry[]>();
    const stands = (material: Material, geometry: BufferGeometry) =>
      still.set(material, [...(still.get(material) ?? []), geometry]);
    for (const { surface, material, part } of scene.ground) {
      const made = part === "edge" ? paints.edge(material) : paints.get(material, true);
      this.ground.add(made);
      stands(made, this.forms.get(surface).clone());
    }
    const coins = new Map<number, Vec3>();
    for (const shape of scene.shapes) {
      if (shape.coin >= 0) coins.set(shape.coin, shape.at);
      if (shape.motion?.kind === "fly") this.flying.push(shape);
      else if (isStill(shape)) {
        const geometry = this.forms.get(shape.form).clone().applyMatrix4(placeOf(shape));
        stands(paints.get(shape.look[0] ?? "", shape.is_material), geometry);
      } else this.changing.push(new Changing(scene, shape, this.slots(shape)));
    }
    for (const [material, geometries] of still) this.addStill(material, geometries);
    for (const batch of this.batches.values()) this.group.add(batch.finish());
    this.flares = new Flares(coins);
    this.glows = new Glows(this.flying.length + MAX_FLARES);
    this.group.add(this.glows.mesh);
  }

  /** Show a frame. */
  show(frame: Frame): void {
    for (const shape of this.changing) shape.show(frame);
    for (const batch of this.batches.values()) batch.changed();
    this.glows.begin();
    for (const shape of this.flying) this.fly(shape, frame.clockS);
    this.flares.show(frame, this.glows);
    this.glows.end();
  }

  /** Let the ground be seen through, or not. */
  setSeenFromBelow(below: boolean): void {
    for (const material of this.ground) {
      material.userData.opacity ??= material.opacity;
      const solid = material.userData.opacity as number;
      material.opacity = below ? Math.min(SEEN_FROM_BELOW, solid) : solid;
      const seenThrough = material.opacity < 1;
      if (material.transparent !== seenThrough) material.needsUpdate = true;
      material.transparent = seenThrough;
      material.depthWrite = !seenThrough;
    }
  }

  dispose(): void {
    this.forms.dispose();
    this.glows.dispose();
    for (const child of this.group.children) {
      if (child instanceof InstancedMesh) child.dispose();
      else if (child instanceof Mesh) child.geometry.dispose();
    }
  }

  private addStill(material: Material, geometries: BufferGeometry[]): void {
    const mesh = new Mesh(mergeGeometries(geometries), material);
    mesh.castShadow = !material.transparent;
    mesh.receiveShadow = true;
    // Glass over everything solid and before lights.
    mesh.renderOrder = material.transparent ? 1 : 0;
    this.group.add(mesh);
  }

  /** Return where a shape may show itself: one place for each of its looks. */
  private slots(shape: Shape): Slot[] {
    return shape.look.map((name) => {
      const material = this.paints.get(name, shape.is_material);
      const key = `${shape.form} ${shape.is_material} ${name}`;
      let batch = this.batches.get(key);
      if (batch === undefined) {
        batch = new Batch(this.forms.get(shape.form), material);
        this.batches.set(key, batch);
      }
      return batch.slot();
    });
  }

  private fly(shape: Shape, clockS: number): void {
    const motion = shape.motion;
    if (motion?.kind !== "fly") return;
    const born = Math.floor(clockS / motion.every_s) - motion.number;
    const age = clockS - born * motion.every_s;
    const left = Math.min(Math.max(1 - age / motion.life_s, 0), 1);
    if (left === 0) return;
    const [x, y, z] = shape.at;
    const reach = motion.speed * age;
    const colour = parseColour(this.scene.paints[shape.look[0] ?? ""]?.colour ?? "#ffffff").rgb;
    this.glows.add(
      x + reach * signed(born, 1),
      y + reach * signed(born, 2),
      z + reach * signed(born, 3),
      0.7 * motion.width * left,
      colour,
      left,
    );
  }
}

function isStill(shape: Shape): boolean {
  return shape.mover < 0 && shape.machine < 0 && shape.coin < 0 && shape.motion === null;
}

/** Return a number from -1 to 1, the same for the same particle. */
function signed(particle: number, axis: number): number {
  const wave = Math.sin(12.9898 * particle + 78.233 * axis) * 43758.5453;
  return 2 * (wave - Math.floor(wave)) - 1;
}

/** A place among the instances of a batch. */
interface Slot {
  batch: Batch;
  index: number;
}

/** Shapes of one form and paint, drawn together. */
class Batch {
  private mesh: InstancedMesh | null = null;
  private count = 0;

  constructor(
    private readonly geometry: BufferGeometry,
    private readonly material: Material,
  ) {}

  slot(): Slot {
    return { batch: this, index: this.count++ };
  }

  /** Return the mesh, after which there are no more slots. */
  finish(): InstancedMesh {
    const mesh = new InstancedMesh(this.geometry, this.material, this.count);
    mesh.instanceMatrix.setUsage(DynamicDrawUsage);
    mesh.frustumCulled = false;
    mesh.castShadow = !this.material.transparent;
    mesh.receiveShadow = mesh.castShadow;
    mesh.renderOrder = this.material.transparent ? 2 : 0;
    this.mesh = mesh;
    return mesh;
  }

  set(index: number, matrix: Matrix4): void {
    this.mesh?.setMatrixAt(index, matrix);
  }

  changed(): void {
    if (this.mesh) this.mesh.instanceMatrix.needsUpdate = true;
  }
}

/** A shape that moves, changes its look or comes and goes. */
class Changing {
  private readonly at: Vector3;
  private readonly along: Vector3;
  private readonly rotation: Quaternion;
  private readonly scale: Vector3;
  private readonly matrix = new Matrix4();
  private readonly position = new Vector3();
  private readonly turned = new Quaternion();

  constructor(
    scene: Scene,
    private readonly shape: Shape,
    private readonly slots: readonly Slot[],
  ) {
    this.at = new Vector3(...shape.at);
    this.along = new Vector3(...(scene.movers[shape.mover]?.along ?? [0, 0, 0]));
    this.rotation = quaternionOf(shape.rotation);
    this.scale = scaleOf(shape);
  }

  show(frame: Frame): void {
    const { shape, slots } = this;
    const phase = frame.phases[shape.machine] ?? 0;
    const seen = shape.seen_in.includes(phase) && !(shape.coin >= 0 && isTaken(frame, shape.coin));
    const look = seen ? Math.min(phase, slots.length - 1) : -1;
    if (seen) this.place(frame);
    slots.forEach(({ batch, index }, i) => {
      batch.set(index, i === look ? this.matrix : HIDDEN);
    });
  }

  private place(frame: Frame): void {
    const displacement = frame.displacements[this.shape.mover] ?? 0;
    this.position.copy(this.at).addScaledVector(this.along, displacement);
    this.turned.copy(this.rotation);
    const { motion } = this.shape;
    if (motion) this.move(motion, frame.clockS);
    this.matrix.compose(this.position, this.turned, this.scale);
  }

  private move(motion: Motion, clockS: number): void {
    if (motion.kind === "spin") {
      const angle = 2 * Math.PI * motion.turns_per_s * clockS + motion.phase;
      const bob = Math.sin(2 * Math.PI * motion.bobs_per_s * clockS + motion.phase);
      this.position.z += motion.bob_m * bob;
      this.turned.premultiply(TURN.setFromAxisAngle(UP, angle));
    } else if (motion.kind === "run") {
      const [x, y, z] = motion.way;
      const length = Math.hypot(x, y, z);
      const share = ((motion.ahead + motion.speed * clockS) % length) / length;
      this.position.addScaledVector(WAY.set(x, y, z), share);
    }
  }
}

const TURN = new Quaternion();
const WAY = new Vector3();
