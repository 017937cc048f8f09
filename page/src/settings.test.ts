import { beforeEach, describe, expect, it } from "vitest";
import { loadSettings, storeSettings } from "./settings";

describe("settings", () => {
  beforeEach(() => localStorage.clear());

  it("are remembered, but for a mode of the game's camera, which lasts a game", () => {
    const changed = { ...loadSettings(), volume: 0.25, muted: true, keys: "world" as const };
    storeSettings({ ...changed, camera: 3 });
    expect(loadSettings()).toEqual({ ...changed, camera: "follow" });
  });

  it("that are nonsense are the defaults", () => {
    const defaults = loadSettings();
    for (const stored of ["{", "3", "null", '{"volume":7,"keys":"arrows","muted":"yes"}']) {
      localStorage.setItem("roller settings", stored);
      expect(loadSettings(), stored).toEqual(defaults);
    }
  });
});
