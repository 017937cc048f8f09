/** The start page: all levels with their pictures, the chosen one large, and Start. */

import type { Actions, LevelMessage, LevelRow, View } from "../types";
import { Dialog } from "./dialog";
import { button, make, setAttribute, setShown, setText } from "./dom";
import { counted, formatTime } from "./format";
import { GhostChoice } from "./ghost";
import { drawMedal } from "./medal";

/** Going through the levels, the one on which one stays so long is loaded; milliseconds. */
const CHOSEN_AFTER_MS = 220;

/** The page on which a level is chosen. */
export class StartPage extends Dialog {
  private levels: readonly LevelRow[] = [];
  private chosen: string | null = null;
  private level: LevelMessage | null = null;
  /** Level that the server was asked for and has not loaded yet. */
  private asked: string | null = null;
  private waiting = 0;
  private readonly cards = make("div", { class: "cards", role: "group", "aria-label": "Levels" });
  private readonly picture = make("img", { class: "hero-picture", alt: "", hidden: "" });
  private readonly heading = make("h2");
  private readonly facts = make("p", { class: "facts" });
  private readonly description = make("p", { class: "description" });
  private readonly status = make("p", { class: "status", role: "status" });
  private readonly ghost: GhostChoice;

  /**
   * @param actions - what the server is told by.
   * @param open - opens another panel over this one.
   */
  constructor(
    private readonly actions: Actions,
    open: (panel: "settings" | "help") => void,
  ) {
    super("Choose a level", "start");
    this.ghost = new GhostChoice(actions);
    const tools = make(
      "nav",
      { class: "tools", "aria-label": "More" },
      button("Settings", "quiet", () => open("settings")),
      button("Help", "quiet", () => open("help")),
    );
    this.element.append(
      make(
        "header",
        { class: "start-head" },
        make("h1", {}, "ROLLER"),
        make("p", { class: "tagline" }, "Collect the coins. Reach the finish. Do not fall."),
        tools,
      ),
      make(
        "div",
        { class: "hero" },
        make(
          "div",
          { class: "hero-about" },
          this.picture,
          this.heading,
          this.facts,
          this.description,
          this.ghost.element,
        ),
        make(
          "div",
          { class: "hero-start" },
          button("Start", "main large", () => this.start()),
          this.status,
        ),
      ),
      this.cards,
    );
  }

  /** Show the levels as they stand. */
  update(view: View): void {
    const { hello, level } = view;
    this.ghost.update(view);
    if (hello === null) return;
    if (hello.levels !== this.levels) this.list(hello.levels);
    if (view.connection === "lost") this.asked = null;
    if (level !== this.level) this.follow(level);
    setText(this.status, level === null || this.asked !== null ? "Loading …" : "");
  }

  /** Make the cards anew; one that has the focus keeps it. */
  private list(levels: readonly LevelRow[]): void {
    this.levels = levels;
    const { activeElement } = document;
    const focused = this.cards.contains(activeElement) && (activeElement as HTMLElement);
    setShown(this.cards, levels.length > 1);
    this.element.classList.toggle("alone", levels.length <= 1);
    this.cards.replaceChildren(...levels.map((row) => this.card(row)));
    this.mark();
    if (focused) this.cardOf(focused.dataset.level ?? "")?.focus({ preventScroll: true });
  }

  override show(shown: boolean): void {
    const opens = shown && !this.isShown;
    super.show(shown);
    if (opens) this.scrollToChosen();
  }

  /** Choose a level beside the chosen one; `rows` is how many rows of cards further down. */
  move(columns: number, rows: number): void {
    const now = this.levels.findIndex((row) => row.name === this.chosen);
    const wide = getComputedStyle(this.cards).gridTemplateColumns.split(" ").length;
    const row = this.levels[now + columns + rows * wide];
    if (row === undefined) return;
    this.choose(row.name);
    this.scrollToChosen();
    if (this.cards.contains(document.activeElement)) this.cardOf(row.name)?.focus();
  }

  /** Begin the chosen level. */
  start(): void {
    this.sendChoice();
    this.actions.send({ type: "start" });
  }

  /** Another level is there: choose it, unless a person has already chosen a further one. */
  private follow(level: LevelMessage | null): void {
    this.level = level;
    if (level === null) return;
    if (level.name === this.asked) this.asked = null;
    if (this.asked !== null || this.waiting !== 0) return;
    this.chosen = level.name;
    this.mark();
    this.scrollToChosen();
  }

  private choose(name: string): void {
    if (name === this.chosen) return;
    this.chosen = name;
    this.mark();
    window.clearTimeout(this.waiting);
    this.waiting = window.setTimeout(() => this.sendChoice(), CHOSEN_AFTER_MS);
  }

  /** Have the chosen level loaded, unless it is or is about to be. */
  private sendChoice(): void {
    window.clearTimeout(this.waiting);
    this.waiting = 0;
    if (this.chosen === null || this.chosen === (this.asked ?? this.level?.name)) return;
    this.asked = this.chosen;
    this.actions.send({ type: "choose", level: this.chosen });
  }

  private card(row: LevelRow): HTMLButtonElement {
    const picture = make("img", { src: row.picture ?? "", alt: "", loading: "lazy" });
    if (row.picture === null) picture.hidden = true;
    const best = row.best_time_s === null ? "not yet won" : formatTime(row.best_time_s);
    const coins = row.best_coins === null ? `${row.coins}` : `${row.best_coins}/${row.coins}`;
    const card = button("", "card", () => undefined);
    card.dataset.level = row.name;
    card.setAttribute("aria-label", describe(row));
    card.append(
      picture,
      make("span", { class: "card-title" }, row.number > 0 ? `${row.number}  ` : "", row.title),
      make(
        "span",
        { class: "card-facts" },
        make("span", {}, best),
        make("span", { class: "card-coins" }, coins),
      ),
      drawMedal(row.medal),
    );
    card.addEventListener("click", (event) => {
      const again = row.name === this.chosen;
      this.choose(row.name);
      // Pressed by Enter, a chosen one starts; after a click Enter is Start's.
      if (event.detail > 0) this.element.querySelector<HTMLElement>("button.main")?.focus();
      else if (again) this.start();
    });
    return card;
  }

  private cardOf(name: string): HTMLElement | null {
    return this.cards.querySelector(`[data-level="${CSS.escape(name)}"]`);
  }

  private scrollToChosen(): void {
    if (this.chosen !== null) this.cardOf(this.chosen)?.scrollIntoView({ block: "nearest" });
  }

  /** Show which level is chosen. */
  private mark(): void {
    for (const card of this.cards.querySelectorAll<HTMLElement>(".card")) {
      setAttribute(card, "aria-pressed", String(card.dataset.level === this.chosen));
    }
    const row = this.levels.find((one) => one.name === this.chosen);
    if (row === undefined) return;
    setText(this.heading, row.number > 0 ? `${row.number}. ${row.title}` : row.title);
    setText(this.facts, factsOf(row).join(" · "));
    setText(this.description, row.description);
    setShown(this.picture, row.picture !== null);
    if (row.picture !== null) setAttribute(this.picture, "src", row.picture);
  }
}

/** What is told of a level in a line. */
function factsOf(row: LevelRow): string[] {
  const par = row.par_time_s === null ? [] : [`par ${formatTime(row.par_time_s)}`];
  const best = row.best_time_s === null ? [] : [`best ${formatTime(row.best_time_s)}`];
  const tries = row.attempts > 0 ? [counted(row.attempts, "attempt")] : [];
  return [counted(row.coins, "coin"), ...par, ...best, ...tries];
}

/** What a screen reader says of a card. */
function describe(row: LevelRow): string {
  const title = row.number > 0 ? `Level ${row.number}: ${row.title}` : row.title;
  const medal = row.medal === null ? [] : [`${row.medal} medal`];
  return [title, ...medal, ...factsOf(row)].join(", ");
}
