/** What an agent sees and thinks: keys, probabilities, value, reward by term, observation. */

import type { AgentMessage, Frame, View } from "../types";
import { make, setProperty, setShown, setText } from "./dom";
import { formatValue } from "./format";
import { Plot } from "./plot";

/** Components of an observation entry that are written out; all are plotted. */
const WRITTEN = 3;

/** A line with a name, a number and a plot. */
class Trace {
  readonly element: HTMLElement;
  private readonly number = make("output");
  private readonly plot = new Plot();

  constructor(name: string) {
    this.element = make(
      "div",
      { class: "trace" },
      make("span", { class: "trace-name" }, name),
      this.plot.canvas,
      this.number,
    );
  }

  push(values: readonly number[]): void {
    const more = values.length > WRITTEN ? " …" : "";
    setText(this.number, values.slice(0, WRITTEN).map(formatValue).join(" ") + more);
    this.plot.push(values);
  }
}

/** A line with a name, a bar and a number. */
class Bar {
  readonly element: HTMLElement;
  private readonly bar = make("span", { class: "bar" });
  private readonly number = make("output");

  constructor(name: string) {
    this.element = make("div", { class: "bar-row" }, make("span", {}, name), this.bar, this.number);
  }

  set(share: number, text: string): void {
    setProperty(this.bar, "--share", Math.min(Math.max(share, 0), 1).toFixed(3));
    setText(this.number, text);
  }
}

/** The panel at the right. */
export class ResearchPanel {
  readonly element: HTMLElement;
  private readonly keys = new Map<string, HTMLElement>();
  private readonly actions = new Lines((name) => new Bar(name));
  private readonly value = new Trace("value");
  private readonly terms = new Lines((name) => new Trace(name));
  private readonly entries = new Lines((name) => new Trace(name));
  private readonly total = make("output");
  private readonly sections: HTMLElement[];
  private shown: AgentMessage | null = null;

  constructor() {
    const pad = make("div", { class: "pad", "aria-hidden": "true" });
    for (const letter of "wasd") {
      const key = make("kbd", { class: `pad-${letter}` }, letter.toUpperCase());
      this.keys.set(letter, key);
      pad.append(key);
    }
    this.sections = [
      section("Actions", this.actions.element),
      section("Value", this.value.element),
      section("Reward so far, by term", this.terms.element),
      section("Observation", this.entries.element),
    ];
    const total = make("p", { class: "total" }, "Reward so far ", this.total);
    const head = make("div", { class: "research-head" }, pad, total);
    this.element = make(
      "section",
      { class: "panel research", "aria-label": "What the agent sees", tabindex: "0" },
      head,
      ...this.sections,
    );
  }

  /**
   * Show what is new.
   *
   * @param view - how the game stands.
   * @param shown - whether the panel is wanted.
   */
  update({ frame, agent }: View, shown: boolean): void {
    setShown(this.element, shown && frame !== null);
    if (!shown || frame === null) return;
    this.showKeys(frame);
    setText(this.total, formatValue(frame.totalReward));
    for (const one of this.sections) setShown(one, agent !== null);
    if (agent === null || agent === this.shown) return;
    this.shown = agent;
    const { actions, probabilities, value, reward_terms: terms } = agent;
    const [acts, worth] = this.sections;
    if (acts) setShown(acts, probabilities !== null);
    if (worth) setShown(worth, value !== null);
    probabilities?.forEach((one, i) => {
      this.actions.of(actions[i] ?? "").set(one, `${Math.round(one * 100)} %`);
    });
    if (value !== null) this.value.push([value]);
    for (const [name, sum] of Object.entries(terms)) this.terms.of(name).push([sum]);
    for (const entry of agent.entries) this.entries.of(entry.name).push(entry.value);
  }

  private showKeys(frame: Frame): void {
    for (const [letter, key] of this.keys) {
      const held = frame.keys.includes(letter);
      if (key.classList.contains("held") !== held) key.classList.toggle("held", held);
    }
  }
}

/** Lines by name, made when they are first needed. */
class Lines<Line extends { readonly element: HTMLElement }> {
  readonly element = make("div");
  private readonly lines = new Map<string, Line>();

  constructor(private readonly makeLine: (name: string) => Line) {}

  of(name: string): Line {
    let line = this.lines.get(name);
    if (line === undefined) {
      line = this.makeLine(name);
      this.lines.set(name, line);
      this.element.append(line.element);
    }
    return line;
  }
}

function section(title: string, ...children: Node[]): HTMLElement {
  return make("div", { class: "research-part" }, make("h3", {}, title), ...children);
}
