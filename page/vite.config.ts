import { defineConfig } from "vitest/config";

// Two bundles: the live page, and one classic script for the replays that anyone opens from disk.
// The HTML around the latter is written by the package, so its names must not change.
export default defineConfig(({ mode }) => ({
  base: "./",
  build: {
    outDir: "../assets/page",
    emptyOutDir: mode !== "replay",
    target: "es2022",
    modulePreload: { polyfill: false },
    ...(mode === "replay" && {
      lib: {
        entry: "src/replay.ts",
        formats: ["iife" as const],
        name: "RollerReplay",
        fileName: () => "replay.js",
        cssFileName: "replay",
      },
    }),
  },
  server: {
    proxy: {
      "/ws": { target: "ws://127.0.0.1:8080", ws: true },
      "/scene": "http://127.0.0.1:8080",
      "/pictures": "http://127.0.0.1:8080",
      "/sounds": "http://127.0.0.1:8080",
    },
  },
  test: { environment: "happy-dom", include: ["src/**/*.test.ts"] },
}));
