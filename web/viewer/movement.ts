/** Whether something moves in the picture, and whether the light of pixels keeps up with it. */
const SLOW = 60; // milliseconds a frame, from which on what moves is shown by the light of texels
const REST = 150; // milliseconds without a move, after which the picture is at rest
const FORGOTTEN = 5000; // milliseconds after which a slow frame does not count any more

/** What the page does while something moves: it is busy, and drawn once more at rest. */
interface Page {
  wait: () => void;
  done: () => void;
  changed: () => void;
}

export class Movement {
  private slow = -Infinity; // when a frame was last slow
  private hasDrawn = false;
  private rest: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly page: Page) {}

  /** The camera or a light has moved. */
  moved(): void {
    if (this.rest === undefined) this.page.wait();
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      this.rest = undefined;
      this.page.done();
      this.page.changed();
    }, REST);
  }

  /** A frame begins, so long after the one before. */
  frame(milliseconds: number): void {
    if (this.hasDrawn && this.rest !== undefined && milliseconds > SLOW) this.slow = performance.now();
    this.hasDrawn = false;
  }

  /** The light of pixels was drawn in this frame. */
  drew(): void {
    this.hasDrawn = true;
  }

  /** Whether pixels may have light of their own now. */
  get allowsPixels(): boolean {
    return this.rest === undefined || performance.now() - this.slow > FORGOTTEN;
  }
}
