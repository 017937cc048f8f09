/** What a level is about, while the camera shows it and the keys do not work yet. */

import type { Actions, View } from "../types";
import { button, make, setShown, setText } from "./dom";

/** As long the game hangs still, and only the level is shown; seconds before the keys work. */
const SHOWN_BELOW_S = 4.83;

/** The intro's panel. */
export class Intro {
  readonly element: HTMLElement;
  private readonly title = make("h2");
  private readonly description = make("p", { class: "description" });
  private readonly wait = make("span", { class: "wait" });
  private readonly skip: HTMLButtonElement;

  /** @param actions - what the server is told by. */
  constructor(actions: Actions) {
    this.skip = button("Begin", "main", () => actions.send({ type: "skip" }));
    this.element = make(
      "section",
      { class: "panel intro", "aria-label": "The level" },
      this.title,
      this.description,
      make("p", { class: "intro-foot" }, this.wait, this.skip),
    );
  }

  /** Show the level during the intro. */
  update({ frame, scene, seat }: View): void {
    const shown = frame?.phase === "intro" && frame.keysInS <= SHOWN_BELOW_S && scene !== null;
    setShown(this.element, shown);
    if (!shown || frame === null || scene === null) return;
    setText(this.title, scene.title);
    setText(this.description, scene.description);
    setText(this.wait, `The keys work in ${Math.ceil(frame.keysInS)} s`);
    setShown(this.skip, seat === "player");
  }
}
