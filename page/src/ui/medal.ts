/** Medals, told apart by shape and letter as well as by colour. */

import type { Medal } from "../types";

const SHAPES: Record<Medal, string> = {
  gold: "M12 1l3 4.2 5-.9-.9 5L23 12l-3.9 2.7.9 5-5-.9L12 23l-3-4.2-5 .9.9-5L1 12l3.9-2.7-.9-5 5 .9z",
  silver: "M7 3h10l5.5 9L17 21H7l-5.5-9z",
  bronze: "M12 2.5a9.5 9.5 0 1 1 0 19 9.5 9.5 0 0 1 0-19z",
};

/** What medals are given for. */
export const MEDAL_RULES: readonly [Medal, string][] = [
  ["gold", "the finish with every coin, within par"],
  ["silver", "the finish with every coin, or within par"],
  ["bronze", "the finish"],
];

/** Draw a medal, or the ring where one could be. */
export function drawMedal(medal: Medal | null): SVGSVGElement {
  const svg = svgElement("svg", { viewBox: "0 0 24 24", class: `medal ${medal ?? "none"}` });
  svg.setAttribute("aria-hidden", "true");
  svg.append(svgElement("path", { d: SHAPES[medal ?? "bronze"] }));
  if (medal !== null) {
    const letter = svgElement("text", { x: "12", y: "16.2", "text-anchor": "middle" });
    letter.textContent = medal[0]?.toUpperCase() ?? "";
    svg.append(letter);
  }
  return svg;
}

/**
 * Return the medal that a game can still end with.
 *
 * @param time - of the game, seconds.
 * @param par - of the level, null if there are no medals.
 */
export function medalInReach(time: number, par: number | null): Medal | null {
  if (par === null) return null;
  return time <= par ? "gold" : "silver";
}

function svgElement<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Record<string, string>,
): SVGElementTagNameMap[K] {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}
