/** What keys, buttons and gamepads ask for. Input finds out what is meant, the panels do it. */

export type Command =
  | "main" // the button that is lit
  | "pause" // pause and go on; close what is open
  | "leave" // the page has lost the focus
  | "restart"
  | "camera"
  | "hand back"
  | "help"
  | "mute"
  | "research"
  | "push" // a direction was newly pressed
  | "step"
  | "slower"
  | "faster"
  | "back" // a second back, or the level to the left
  | "forward"
  | "up" // the level above
  | "down";

const EVENT = "roller-command";

/** Ask for something. */
export function giveCommand(command: Command): void {
  window.dispatchEvent(new CustomEvent<Command>(EVENT, { detail: command }));
}

/** Hear what is asked for. */
export function onCommand(obey: (command: Command) => void): void {
  window.addEventListener(EVENT, (event) => obey((event as CustomEvent<Command>).detail));
}
