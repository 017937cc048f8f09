import { beforeEach, expect, it, vi } from "vitest";
import { clearPages, fakeFrame, fakeView } from "../fakes";
import type { ToServer } from "../types";
import { type Command, onCommand } from "./commands";
import { Input } from "./index";

let sent: ToServer[];
let yaw: number;
let input: Input;

clearPages();

beforeEach(() => {
  vi.useFakeTimers();
  sent = [];
  yaw = 0;
  const actions = {
    send: (message: ToServer) => sent.push(message),
    setSettings: () => undefined,
    nextCamera: () => undefined,
  };
  input = new Input(document.body, actions, () => yaw);
  input.update(fakeView());
});

function key(kind: "keydown" | "keyup", code: string, target: EventTarget = window): KeyboardEvent {
  const letter = code.startsWith("Key") ? code.slice(3).toLowerCase() : code;
  const event = new KeyboardEvent(kind, { code, key: letter, bubbles: true, cancelable: true });
  target.dispatchEvent(event);
  return event;
}

function held(): string[] {
  return sent.flatMap((message) => (message.type === "keys" ? [message.held] : []));
}

it("tells the keys that are held when they change, and again while they are", () => {
  key("keydown", "KeyW");
  key("keydown", "ArrowRight");
  expect(held()).toEqual(["w", "wd"]);
  vi.advanceTimersByTime(500);
  expect(held()).toEqual(["w", "wd", "wd", "wd"]);
  key("keyup", "KeyW");
  key("keyup", "ArrowRight");
  expect(held().slice(-2)).toEqual(["d", ""]);
  vi.advanceTimersByTime(1000);
  expect(held().at(-1)).toBe("");
  expect(held().length).toBe(6);
});

it("turns held keys with the camera where they are relative to it", () => {
  const view = fakeView();
  view.settings = { ...view.settings, keys: "camera" };
  input.update(view);
  key("keydown", "KeyW");
  yaw = Math.PI / 2;
  input.update(view);
  expect(held()).toEqual(["w", "a"]);
  expect(input.held()).toBe("a");
});

it("lets the keys go when the page loses the focus", () => {
  key("keydown", "KeyS");
  window.dispatchEvent(new Event("blur"));
  expect(held()).toEqual(["s", ""]);
});

it("tells nothing where keys do not push", () => {
  for (const view of [
    fakeView({ seat: "spectator" }),
    fakeView({ frame: fakeFrame({ phase: "start" }) }),
    fakeView({ frame: fakeFrame({ phase: "ended" }) }),
    fakeView({}, { mode: "replay" }),
  ]) {
    input.update(view);
    key("keydown", "KeyW");
    key("keyup", "KeyW");
  }
  expect(sent).toEqual([]);
});

it("pauses a replay with Space though the bar of its time line has the focus", () => {
  input.update(fakeView({}, { mode: "replay" }));
  const commands: Command[] = [];
  onCommand((command) => commands.push(command));
  const bar = document.createElement("input");
  bar.type = "range";
  document.body.append(bar);
  bar.dispatchEvent(new KeyboardEvent("keydown", { code: "Space", key: " ", bubbles: true }));
  expect(commands).toEqual(["pause"]);
});

it("leaves the keys to a field or button that has the focus", () => {
  const field = document.createElement("input");
  document.body.append(field);
  expect(key("keydown", "ArrowLeft", field).defaultPrevented).toBe(false);
  expect(key("keydown", "ArrowLeft").defaultPrevented).toBe(true);
  const button = document.createElement("button");
  document.body.append(button);
  expect(key("keydown", "Enter", button).defaultPrevented).toBe(false);
});

it("pushes to where a finger draws the stick", () => {
  Object.defineProperty(navigator, "maxTouchPoints", { value: 5, configurable: true });
  vi.stubGlobal("matchMedia", () => ({ matches: true }));
  input.update(fakeView());
  const zone = document.querySelector<HTMLElement>(".stick-zone");
  if (zone === null) throw new Error("there is no stick");
  zone.setPointerCapture = () => undefined;
  const finger = (kind: string, clientX: number, clientY: number): void => {
    zone.dispatchEvent(new PointerEvent(kind, { pointerId: 1, clientX, clientY }));
  };
  finger("pointerdown", 100, 300);
  finger("pointermove", 100, 200);
  finger("pointermove", 180, 220);
  finger("pointerup", 180, 220);
  expect(held()).toEqual(["w", "wd", ""]);
  expect(zone.hidden).toBe(false);
  input.update(fakeView({ frame: fakeFrame({ phase: "paused" }) }));
  expect(zone.hidden).toBe(true);
});
