/** The state in the page's address: written some time after changes, and known again when it comes back as an event. */
import { encodeState, type State } from "./state";

const EVERY = 350; // milliseconds: Safari allows a hundred in half a minute

export class Address {
  private timer = 0;
  private written = "";

  constructor(private readonly state: State) {}

  /** The state may have changed. */
  touch(): void {
    document.body.dataset.address = "old";
    if (this.timer) return;
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      this.written = encodeState(this.state);
      history.replaceState(undefined, "", this.written);
      document.body.dataset.address = "written";
    }, EVERY);
  }

  /** Whether an address is another one than the last that was written or taken; it is taken then. */
  take(hash: string): boolean {
    const other = hash !== this.written;
    this.written = hash;
    return other;
  }
}
