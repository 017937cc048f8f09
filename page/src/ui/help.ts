/** The help: what the game wants, and all keys. */

import { KEYS_HELP, TIME_KEYS_HELP } from "../input/keyboard";
import { Dialog } from "./dialog";
import { button, make } from "./dom";
import { drawMedal, MEDAL_RULES } from "./medal";

/** What can be pressed, and what it does. */
export class HelpPanel extends Dialog {
  /** @param close - hides the panel. */
  constructor(close: () => void) {
    super("Help", "help");
    this.element.append(
      make("h2", {}, "Help"),
      make("p", {}, "Collect the coins, ten points each. Reach the finish. Do not fall."),
      make(
        "div",
        { class: "help-columns" },
        rows([...KEYS_HELP, ...TIME_KEYS_HELP]),
        make(
          "div",
          {},
          make("h3", {}, "Medals"),
          make(
            "ul",
            { class: "medals" },
            ...MEDAL_RULES.map(([medal, rule]) =>
              make("li", {}, drawMedal(medal), make("span", {}, `${medal}: ${rule}`)),
            ),
          ),
          make("h3", {}, "Fingers and gamepads"),
          make(
            "p",
            {},
            "Put a finger down and draw it where the ball is to go. ",
            "On a gamepad the left stick or the cross pushes; A presses what is lit, Y changes the ",
            "camera, Start pauses.",
          ),
          make("h3", {}, "Keyboards"),
          make(
            "p",
            {},
            "W A S D are meant by their place, at the left of any keyboard: ",
            "Z Q S D on a French one.",
          ),
        ),
      ),
      button("Done", "main", close),
    );
  }
}

function rows(lines: readonly [string, string][]): HTMLElement {
  return make(
    "dl",
    { class: "keys" },
    ...lines.map(([keys, what]) => make("div", {}, make("dt", {}, keys), make("dd", {}, what))),
  );
}
