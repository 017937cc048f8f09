/** Settings, which the browser remembers. */

import type { Settings } from "./types";

const STORED_AS = "roller settings";

const DEFAULTS: Settings = {
  keys: "camera",
  camera: "follow",
  quality: "auto",
  volume: 0.7,
  muted: false,
  speedLabels: false,
};

const CHECKS: { [Name in keyof Settings]: (value: unknown) => boolean } = {
  keys: (value) => value === "world" || value === "camera",
  // A mode of the game's lasts until the game changes it, so none is remembered.
  camera: (value) => value === "game" || value === "follow" || value === "orbit",
  quality: (value) => value === "high" || value === "low" || value === "auto",
  volume: (value) => typeof value === "number" && value >= 0 && value <= 1,
  muted: (value) => typeof value === "boolean",
  speedLabels: (value) => typeof value === "boolean",
};

/** Return what was stored, and where that is nothing or nonsense, the default. */
export function loadSettings(): Settings {
  const stored = read();
  const known = Object.entries(CHECKS).filter(([name, holds]) => holds(stored[name]));
  return { ...DEFAULTS, ...Object.fromEntries(known.map(([name]) => [name, stored[name]])) };
}

export function storeSettings(settings: Settings): void {
  try {
    localStorage.setItem(STORED_AS, JSON.stringify(settings));
  } catch {
    // A page opened from disk may be denied any memory: then settings last as long as it.
  }
}

function read(): Record<string, unknown> {
  try {
    const stored: unknown = JSON.parse(localStorage.getItem(STORED_AS) ?? "{}");
    return typeof stored === "object" && stored !== null ? { ...stored } : {};
  } catch {
    return {};
  }
}
