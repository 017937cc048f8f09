import { expect, it } from "vitest";
import { counted, formatLead, formatTime, formatValue } from "./format";

it("writes times in seconds, and from a minute on with minutes", () => {
  expect([0, 9.94, 59.94, 59.96, 60, 62.3, 754.05].map(formatTime)).toEqual([
    "0.0 s",
    "9.9 s",
    "59.9 s",
    "1:00.0",
    "1:00.0",
    "1:02.3",
    "12:34.1",
  ]);
});

it("writes by how much one was faster or slower", () => {
  expect(formatLead(18.8, 20)).toBe("−1.2 s");
  expect(formatLead(21.5, 20)).toBe("+1.5 s");
  expect(formatLead(20.01, 20)).toBe("±0.0 s");
  expect(formatLead(4.14, 3.18)).toBe("+0.9 s");
});

it("counts things", () => {
  expect([counted(1, "coin"), counted(2, "coin"), counted(0, "try", "tries")]).toEqual([
    "1 coin",
    "2 coins",
    "0 tries",
  ]);
});

it("writes values in a few digits", () => {
  expect([0.1234, -1.234, 12.34, 1234.5, 123456].map(formatValue)).toEqual([
    "0.123",
    "-1.23",
    "12.3",
    "1235",
    "1.2e+5",
  ]);
});
