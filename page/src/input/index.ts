/** Input: what a person does at keyboard, screen and gamepad, as held keys and commands. */

import type { Actions, View } from "../types";
import { giveCommand } from "./commands";
import { type Held, heldFor, type Push, pushOf } from "./directions";
import { GamepadReader } from "./gamepad";
import { commandOf, DIRECTION_KEYS, type Place } from "./keyboard";
import { TouchStick } from "./touch";

/** Held keys are told this often, since the server lets those go of which it hears nothing. */
const TELL_EVERY_MS = 250;

/** Takes input for the game. */
export class Input {
  private readonly codes = new Set<string>();
  private readonly pads = new GamepadReader();
  private readonly stick: TouchStick;
  private padPush: Push = { ahead: 0, left: 0 };
  private told: Held = "";
  private kept: Held = "";
  private view: View | null = null;

  /**
   * @param target - what the touch stick is put into.
   * @param actions - what the server is told by.
   * @param cameraYaw - angle from +x to the camera's sight, to the left, radians.
   */
  constructor(
    target: HTMLElement,
    private readonly actions: Actions,
    private readonly cameraYaw: () => number,
  ) {
    this.stick = new TouchStick(target, () => this.changed());
    window.addEventListener("keydown", (event) => this.keyDown(event));
    window.addEventListener("keyup", (event) => {
      // While Meta is held, macOS does not tell that other keys are let go.
      if (event.key === "Meta") this.codes.clear();
      this.codes.delete(event.code);
      this.tell();
    });
    window.addEventListener("blur", () => this.leave());
    document.addEventListener("visibilitychange", () => {
      if (document.hidden) this.leave();
    });
    window.setInterval(() => this.told !== "" && this.tell(true), TELL_EVERY_MS);
  }

  /** Return the keys that are held, letters of "wasd" along the world's axes. */
  held(): Held {
    const letters = [...this.codes].map((code) => DIRECTION_KEYS[code] ?? "").join("");
    const keys = pushOf(letters);
    const pushes = [keys, this.stick.push, this.padPush];
    const push = pushes.find(({ ahead, left }) => ahead !== 0 || left !== 0) ?? keys;
    const yaw = this.view?.settings.keys === "camera" ? this.cameraYaw() : 0;
    this.kept = heldFor(push, yaw, this.kept);
    return this.kept;
  }

  /** Look at the gamepad, and follow the camera's turns; once for each frame drawn. */
  update(view: View): void {
    this.view = view;
    const drawn = this.steers() && view.frame?.phase !== "paused" && isTouched();
    this.stick.enable(drawn, view.settings.camera === "orbit");
    this.readPad();
    this.tell();
  }

  private keyDown(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey || isTakenBy(event.target, event)) return;
    const place = this.place();
    const command = commandOf(event.key, event.code, place);
    if (command !== null) {
      event.preventDefault();
      if (!event.repeat || event.code.startsWith("Arrow")) giveCommand(command);
    } else if (event.code in DIRECTION_KEYS && place !== "replay") {
      if (event.code.startsWith("Arrow")) event.preventDefault();
      if (event.repeat) return;
      this.codes.add(event.code);
      this.changed();
    }
  }

  private place(): Place {
    if (this.view?.hello?.mode === "replay") return "replay";
    return this.view?.frame?.phase === "start" ? "menu" : "game";
  }

  /** Whether held keys mean anything to the game as it stands. */
  private steers(): boolean {
    const { hello, seat, frame } = this.view ?? {};
    if (seat !== "player" || hello?.mode === "replay" || frame == null) return false;
    return frame.phase !== "start" && frame.phase !== "ended";
  }

  private readPad(): void {
    const pad = navigator.getGamepads?.().find((one) => one?.mapping === "standard");
    if (pad == null) {
      this.padPush = { ahead: 0, left: 0 };
      return;
    }
    const { push, commands } = this.pads.read(pad, this.place() !== "game");
    const was = this.padPush;
    this.padPush = push;
    for (const command of commands) giveCommand(command);
    if (push.ahead === was.ahead && push.left === was.left) return;
    this.changed();
  }

  /** Something is pushed in another way than before. */
  private changed(): void {
    const before = this.told;
    if (this.held() !== before && this.kept !== "" && this.steers()) giveCommand("push");
    this.tell();
  }

  /** Tell the server what is held, if that is news. */
  private tell(again = false): void {
    const held = this.steers() ? this.held() : "";
    if (held === this.told && !again) return;
    this.told = held;
    this.actions.send({ type: "keys", held });
  }

  private leave(): void {
    this.codes.clear();
    this.stick.release();
    this.padPush = { ahead: 0, left: 0 };
    this.tell();
    giveCommand("leave");
  }
}

/** Whether what has the focus does something of its own with a key. */
function isTakenBy(target: EventTarget | null, { key }: KeyboardEvent): boolean {
  if (target instanceof HTMLButtonElement && (key === "Enter" || key === " ")) return true;
  if (target instanceof HTMLSelectElement) return key !== "Escape";
  const inField = target instanceof HTMLInputElement;
  if (key === " ") return inField && target.type === "checkbox";
  // Panels scroll with the arrows, but on the start page they choose.
  const inPanel = target instanceof Element && target.closest(".dialog:not(.start)") !== null;
  return key.startsWith("Arrow") && (inField || inPanel);
}

/** Whether the page is used with fingers. */
function isTouched(): boolean {
  return navigator.maxTouchPoints > 0 && matchMedia("(any-pointer: coarse)").matches;
}
