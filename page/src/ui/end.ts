/** The panel of a game that is over. */

import type { Actions, LevelRow, ResultMessage, View } from "../types";
import { Dialog } from "./dialog";
import { button, make, setShown, setText } from "./dom";
import { formatLead, formatTime } from "./format";
import { drawMedal } from "./medal";

const TITLES: Record<ResultMessage["outcome"], string> = {
  finish: "Finish!",
  fall: "You fell",
  "time limit": "The time is up",
  diverged: "The physics failed",
};

/** How a game went, and what comes next. */
export class EndPanel extends Dialog {
  private readonly medal = make("div", { class: "end-medal" });
  private readonly title = make("h2");
  private readonly word = make("p", { class: "end-word" });
  private readonly rows = make("dl", { class: "rows" });
  private readonly next: HTMLButtonElement;
  private readonly again: HTMLButtonElement;
  private readonly buttons: HTMLElement;
  private shown: ResultMessage | null = null;

  /** @param actions - what the server is told by. */
  constructor(actions: Actions) {
    super("The game is over", "end");
    this.next = button("Next level", "main", () => actions.send({ type: "next" }));
    this.again = button("Play again", "", () => actions.send({ type: "restart" }));
    const levels = button("Levels", "", () => actions.send({ type: "menu" }));
    this.buttons = make("div", { class: "end-buttons" }, this.next, this.again, levels);
    this.element.append(this.medal, this.title, this.word, this.rows, this.buttons);
  }

  /** Show a game's result; before it is shown. */
  update(view: View): void {
    const { hello, level, result, scene, seat } = view;
    setShown(this.buttons, seat === "player");
    if (result === null || result === this.shown) return;
    this.shown = result;
    const row = hello?.levels.find((one) => one.name === level?.name) ?? null;
    setText(this.title, TITLES[result.outcome]);
    this.medal.replaceChildren(...(result.medal ? [drawMedal(result.medal)] : []));
    setShown(this.medal, result.medal !== null);
    setText(this.word, wordOf(result));
    setShown(this.word, this.word.textContent !== "");
    const told = rowsOf(result, row, scene?.par_time_s ?? null);
    this.rows.replaceChildren(
      ...told.map(([name, value, note]) =>
        make("div", {}, make("dt", {}, name), make("dd", {}, value, make("small", {}, note))),
      ),
    );
    const following = hello?.levels.find((one) => one.name === result.next);
    setShown(this.next, result.next !== null);
    setText(this.next, following ? `Next: ${following.title}` : "Next level");
    this.again.classList.toggle("main", result.next === null);
  }
}

/** What is to be said of a result at once. */
export function wordOf(result: ResultMessage): string {
  if (!result.counts) return "Practice: this one does not count.";
  if (result.outcome !== "finish") return "";
  const left = result.coins_in_level - result.coins;
  if (left > 0 && result.next === null) return `The next level asks for every coin: ${left} left.`;
  return result.best_time ? "A new best time!" : "";
}

/** What a result is made of: a name, a value, and what it is beside others. */
export function rowsOf(
  result: ResultMessage,
  row: LevelRow | null,
  par: number | null,
): [string, string, string][] {
  const { coins, coins_in_level: all, points, time_s: time } = result;
  const best = row?.best_time_s ?? null;
  const beside = [
    ...(par === null ? [] : [`par ${formatTime(par)} (${formatLead(time, par)})`]),
    ...(result.best_time || best === null
      ? []
      : [`best ${formatTime(best)} (${formatLead(time, best)})`]),
  ];
  const most = row?.best_coins ?? null;
  const coinNote = result.best_coins
    ? "new best"
    : most !== null && most > coins
      ? `best ${most}`
      : "";
  return [
    ["Time", formatTime(time), beside.join(", ")],
    ["Coins", `${coins} of ${all}`, coinNote],
    ["Points", String(points), `${result.score_percent.toFixed(0)} %`],
  ];
}
