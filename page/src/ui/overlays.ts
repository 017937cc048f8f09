/** What is told about the page itself: loading, a lost connection, who steers, a wrong level file. */

import type { Actions, Problem, ProblemsMessage, View } from "../types";
import { button, make, setShown, setText } from "./dom";
import { counted } from "./format";

/** Covers the page as long as there is nothing to see or the server is away. */
export class ConnectionOverlay {
  readonly element: HTMLElement;
  private readonly title = make("h2");
  private readonly text = make("p");

  constructor() {
    const inner = make("div", { class: "panel" }, this.title, this.text);
    this.element = make("div", { class: "cover", role: "alert", hidden: "" }, inner);
  }

  /**
   * Show it if it is needed.
   *
   * @param view - how the game stands.
   * @param choosing - whether the start page is there: it says itself that a level is being loaded.
   */
  update({ connection, hello, frame, scene }: View, choosing: boolean): void {
    const lost = connection === "lost";
    const loading = hello === null || ((frame === null || scene === null) && !choosing);
    setShown(this.element, lost || loading);
    this.element.classList.toggle("lost", lost && hello !== null);
    setText(this.title, lost && hello !== null ? "Connection lost" : "Loading …");
    const text =
      "The game is paused. The page connects again by itself as soon as the server answers.";
    setText(this.text, lost && hello !== null ? text : "");
  }
}

/** Says to who watches that they do, and lets them ask for the controls. */
export class SeatLine {
  readonly element: HTMLElement;
  private readonly text = make("span");
  private readonly ask: HTMLButtonElement;
  private asked = false;

  /** @param actions - what the server is asked by. */
  constructor(actions: Actions) {
    this.ask = button("Ask to play", "main", () => {
      this.asked = true;
      actions.send({ type: "ask_seat" });
    });
    this.element = make("div", { class: "panel seat", role: "status" }, this.text, this.ask);
  }

  /** Show it to who watches. */
  update({ seat, frame, hello, connection }: View): void {
    if (seat === "player" || connection === "lost") this.asked = false;
    setShown(this.element, seat === "spectator" && hello !== null);
    setShown(this.ask, !this.asked);
    setText(this.text, this.asked ? "You are next when the player leaves" : watching(frame?.phase));
  }
}

function watching(phase: string | undefined): string {
  if (phase === "start") return "You watch. The player chooses a level";
  return phase === "paused" ? "You watch. The game is paused" : "You watch";
}

/** What is wrong with the level file that is being written. */
export class ProblemsPanel {
  readonly element = make("section", {
    class: "panel problems",
    role: "status",
    "aria-label": "Problems of the level file",
    tabindex: "0",
    hidden: "",
  });
  private shown: ProblemsMessage | null = null;

  /** Show what was wrong when the file was saved last. */
  update({ problems }: View): void {
    if (problems === this.shown) return;
    this.shown = problems;
    setShown(this.element, problems !== null);
    if (problems === null) return;
    const { file, errors, warnings } = problems;
    const counts = [
      ...(errors.length > 0 ? [counted(errors.length, "error")] : []),
      ...(warnings.length > 0 ? [counted(warnings.length, "warning")] : []),
    ];
    const summary = counts.length > 0 ? counts.join(", ") : "all is well";
    this.element.classList.toggle("wrong", errors.length > 0);
    this.element.replaceChildren(
      make("h3", {}, `${file}: ${summary}`),
      ...(errors.length > 0 ? [make("p", {}, "The level is shown as it last was right.")] : []),
      make(
        "ul",
        {},
        ...errors.map((problem) => line("error", problem)),
        ...warnings.map((problem) => line("warning", problem)),
      ),
    );
  }
}

function line(kind: "error" | "warning", { where, line: number, text }: Problem): HTMLElement {
  const place = number === null ? where : `line ${number}, ${where}`;
  return make(
    "li",
    { class: kind },
    make("strong", {}, kind),
    make("code", {}, place),
    make("span", {}, text),
  );
}
