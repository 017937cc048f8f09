/** The settings. */

import type { Actions, Settings, View } from "../types";
import { CAMERA_NAMES } from "./cameras";
import { Dialog } from "./dialog";
import { button, make, setShown } from "./dom";

/** Settings that are chosen from a list, with what their values are called. */
const CHOICES = {
  keys: [
    ["world", "the level"],
    ["camera", "the camera"],
  ],
  camera: [
    ["follow", "follow the ball"],
    ["orbit", "orbit: drag it"],
    ["game", "as in the original"],
    ...CAMERA_NAMES.map((name, number) => [String(number), name] as const),
  ],
  quality: [
    ["auto", "automatic"],
    ["high", "high"],
    ["low", "low"],
  ],
} as const;
const LABELS = { keys: "Keys push along", camera: "Camera", quality: "Picture" };
type Choice = keyof typeof CHOICES;

/** What a person sets once, kept by the browser. */
export class SettingsPanel extends Dialog {
  private readonly selects = new Map<Choice, HTMLSelectElement>();
  private readonly volume = make("input", { type: "range", min: "0", max: "1", step: "0.05" });
  private readonly muted = make("input", { type: "checkbox" });
  private readonly speed = make("input", { type: "checkbox" });
  private readonly leave: HTMLButtonElement;
  private shown: Settings | null = null;

  /**
   * @param actions - what settings are changed by.
   * @param close - hides the panel.
   */
  constructor(actions: Actions, close: () => void) {
    super("Settings", "settings");
    this.element.append(make("h2", {}, "Settings"));
    for (const name of Object.keys(CHOICES) as Choice[]) {
      const select = make("select");
      select.append(...CHOICES[name].map(([value, text]) => make("option", { value }, text)));
      select.addEventListener("change", () => actions.setSettings(read(name, select.value)));
      this.selects.set(name, select);
      this.element.append(field(LABELS[name], select));
    }
    this.volume.addEventListener("input", () =>
      actions.setSettings({ volume: Number(this.volume.value) }),
    );
    this.muted.addEventListener("change", () => actions.setSettings({ muted: this.muted.checked }));
    this.speed.addEventListener("change", () =>
      actions.setSettings({ speedLabels: this.speed.checked }),
    );
    this.leave = button("Let somebody else play", "quiet", () => {
      actions.send({ type: "leave_seat" });
      close();
    });
    this.element.append(
      field("Volume", this.volume),
      field("Mute", this.muted),
      field("Show the speed", this.speed),
      make("div", { class: "row" }, this.leave, button("Done", "main", close)),
    );
  }

  /** Show the settings as they are. */
  update({ settings, seat, hello }: View): void {
    setShown(this.leave, seat === "player" && hello?.mode !== "replay");
    if (settings === this.shown) return;
    this.shown = settings;
    for (const [name, select] of this.selects) select.value = String(settings[name]);
    this.volume.value = String(settings.volume);
    this.muted.checked = settings.muted;
    this.speed.checked = settings.speedLabels;
  }
}

/** Return what a value in a list sets. */
function read(name: Choice, value: string): Partial<Settings> {
  return { [name]: /^\d$/.test(value) ? Number(value) : value };
}

function field(label: string, control: HTMLElement): HTMLElement {
  return make("label", { class: "field" }, make("span", {}, label), control);
}
