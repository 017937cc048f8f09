/** Names of pieces that hang over them. */

import { CanvasTexture, Group, Sprite, SpriteMaterial, SRGBColorSpace } from "three";
import type { Scene } from "../types";

const FONT_PIXELS = 44;
const PADDING_PIXELS = 18;
const HEIGHT_M = 0.34;
const OVER_M = 0.9;

export class Labels {
  readonly group = new Group();

  constructor(scene: Scene) {
    for (const { text, at } of scene.labels) {
      const sprite = label(text);
      sprite.position.set(at[0], at[1], at[2] + OVER_M);
      this.group.add(sprite);
    }
  }

  dispose(): void {
    for (const child of this.group.children) {
      if (!(child instanceof Sprite)) continue;
      child.material.map?.dispose();
      child.material.dispose();
    }
  }
}

function label(text: string): Sprite {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("this browser paints no 2D canvas");
  const font = `600 ${FONT_PIXELS}px system-ui, sans-serif`;
  context.font = font;
  canvas.width = Math.ceil(context.measureText(text).width) + 2 * PADDING_PIXELS;
  canvas.height = FONT_PIXELS + 2 * PADDING_PIXELS;
  context.fillStyle = "rgba(13, 23, 38, 0.75)";
  context.roundRect(0, 0, canvas.width, canvas.height, PADDING_PIXELS);
  context.fill();
  context.font = font;
  context.fillStyle = "#ffffff";
  context.textBaseline = "middle";
  context.fillText(text, PADDING_PIXELS, canvas.height / 2);
  const map = new CanvasTexture(canvas);
  map.colorSpace = SRGBColorSpace;
  const sprite = new Sprite(new SpriteMaterial({ map, depthWrite: false }));
  sprite.scale.set((HEIGHT_M * canvas.width) / canvas.height, HEIGHT_M, 1);
  sprite.renderOrder = 4;
  return sprite;
}
