import { describe, expect, it } from "vitest";
import { commandOf, DIRECTION_KEYS } from "./keyboard";

describe("keys", () => {
  it("push by their place, whatever is printed on them", () => {
    expect(DIRECTION_KEYS.KeyW).toBe("w");
    expect(commandOf("z", "KeyW", "game")).toBeNull();
    // On a Dvorak keyboard a P is printed where R is on others.
    expect(commandOf("p", "KeyR", "game")).toBe("pause");
  });

  it("ask by what is printed on them, and by their place where that is no Latin letter", () => {
    expect(commandOf("m", "Semicolon", "game")).toBe("mute");
    expect(commandOf("ь", "KeyM", "game")).toBe("mute");
    expect(commandOf("P", "KeyP", "game")).toBe("pause");
    expect(commandOf("Enter", "NumpadEnter", "game")).toBe("main");
    expect(commandOf("x", "KeyX", "game")).toBeNull();
  });

  it("push, choose or seek with the arrows", () => {
    expect(commandOf("ArrowLeft", "ArrowLeft", "game")).toBeNull();
    expect(commandOf("ArrowLeft", "ArrowLeft", "menu")).toBe("back");
    expect(commandOf("ArrowRight", "ArrowRight", "replay")).toBe("forward");
    expect(commandOf(" ", "Space", "replay")).toBe("pause");
    expect(commandOf(" ", "Space", "game")).toBeNull();
  });
});
