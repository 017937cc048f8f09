/** The panel of a pause. */

import { giveCommand } from "../input/commands";
import type { Actions, View } from "../types";
import { Dialog } from "./dialog";
import { button, make, setShown } from "./dom";
import { GhostChoice } from "./ghost";

/** What can be done while the game stands still. */
export class PausePanel extends Dialog {
  private readonly ghost: GhostChoice;
  private readonly handBack = button("Let the agent play", "quiet", () => giveCommand("hand back"));

  /**
   * @param actions - what the server is told by.
   * @param open - opens another panel over this one.
   */
  constructor(actions: Actions, open: (panel: "settings" | "help") => void) {
    super("Pause", "pause");
    this.ghost = new GhostChoice(actions);
    this.element.append(
      make("h2", {}, "Pause"),
      button("Go on", "main", () => actions.send({ type: "resume" })),
      button("Restart", "", () => actions.send({ type: "restart" })),
      button("Levels", "", () => actions.send({ type: "menu" })),
      this.ghost.element,
      make(
        "div",
        { class: "row" },
        button("Look back", "quiet", () => giveCommand("research")),
        this.handBack,
        button("Settings", "quiet", () => open("settings")),
        button("Help", "quiet", () => open("help")),
      ),
    );
  }

  /** Show who could play on. */
  update(view: View): void {
    this.ghost.update(view);
    setShown(this.handBack, view.frame?.hasAgent === true && !view.frame.agentPlays);
  }
}
