/** A panel over the game that wants an answer. */

import { make, setShown } from "./dom";

/** A named panel; its button of the class "main" is lit, and pressed by Enter. */
export class Dialog {
  readonly element: HTMLElement;
  private before: Element | null = null;

  /**
   * @param label - what screen readers call it.
   * @param kind - its class.
   * @param children - what is in it.
   */
  constructor(label: string, kind: string, ...children: Node[]) {
    this.element = make(
      "section",
      {
        role: "dialog",
        "aria-modal": "true",
        "aria-label": label,
        class: `dialog ${kind}`,
        tabindex: "-1",
      },
      ...children,
    );
    this.element.hidden = true;
  }

  get isShown(): boolean {
    return !this.element.hidden;
  }

  /** Show it, with the focus on what is lit, or hide it and put the focus back. */
  show(shown: boolean): void {
    if (shown === this.isShown) return;
    setShown(this.element, shown);
    if (shown) {
      this.before = document.activeElement;
      (this.main() ?? this.element).focus({ preventScroll: true });
    } else if (this.before instanceof HTMLElement && this.before.isConnected) {
      this.before.focus({ preventScroll: true });
      // What is hidden takes no focus: the keys are the game's again.
      if (document.activeElement !== this.before) (document.activeElement as HTMLElement)?.blur();
    }
  }

  /** Press the button that is lit. */
  pressMain(): void {
    this.main()?.click();
  }

  private main(): HTMLElement | null {
    const lit = this.element.querySelectorAll<HTMLElement>("button.main");
    return [...lit].find((one) => one.closest("[hidden]") === null) ?? null;
  }
}
