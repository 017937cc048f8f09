/** Against whom one races. */

import type { Actions, LevelMessage, ToServer, View } from "../types";
import { make, setShown } from "./dom";

type GhostKind = Extract<ToServer, { type: "ghost" }>["kind"];

const KINDS: readonly [GhostKind, string][] = [
  ["none", "nobody"],
  ["best", "your best run"],
  ["par", "the run that comes with the level"],
];

/** The choice last made, which the start page and the pause panel share. */
let chosen: GhostKind = "none";
let level: LevelMessage | null = null;

/** A choice of the ghost that rolls beside the ball. */
export class GhostChoice {
  readonly element: HTMLElement;
  private readonly select = make("select", { class: "ghost" });

  /** @param actions - what the server is told by. */
  constructor(actions: Actions) {
    this.select.append(...KINDS.map(([kind, text]) => make("option", { value: kind }, text)));
    this.element = make("label", { class: "field" }, make("span", {}, "Race against"), this.select);
    this.select.addEventListener("change", () => {
      chosen = this.select.value as GhostKind;
      actions.send({ type: "ghost", kind: chosen });
    });
  }

  /** Show what is chosen; those who watch choose nothing. */
  update(view: View): void {
    setShown(this.element, view.seat === "player" && view.hello?.mode === "play");
    if (view.level !== level) {
      // The server knows it, also after a reload.
      level = view.level;
      chosen = level?.ghost ?? chosen;
    }
    if (this.select.value !== chosen) this.select.value = chosen;
  }
}
