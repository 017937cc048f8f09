import { defineConfig } from "vitest/config";

// One program for the live page and for replays that are opened from disk. The package writes the
// HTML round the latter, so the names must not change.
export default defineConfig({
  base: "./",
  build: {
    outDir: "../assets/page",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: { polyfill: false },
    assetsDir: ".",
    cssCodeSplit: false,
    chunkSizeWarningLimit: 800,
    rolldownOptions: {
      output: { format: "iife", entryFileNames: "roller.js", assetFileNames: "roller.[ext]" },
    },
  },
  test: { environment: "happy-dom", include: ["src/**/*.test.ts"] },
});
