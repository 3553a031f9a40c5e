/** What can be taken back: the lights, what is painted, and how the picture is shown; not where one looks from. */
import type { State } from "./state";

const CALM = 400; // milliseconds without a change that end a step: a drag is one
const MOST = 100; // steps

type Step = Pick<State, "lights" | "surfaces" | "ball" | "exposure" | "tone" | "terms">;

export class History {
  private readonly past: string[] = [];
  private readonly future: string[] = [];
  private now: string;
  private timer = 0;

  constructor(private readonly state: State) {
    this.now = stepOf(state);
  }

  /** The state may have changed. */
  touch(): void {
    window.clearTimeout(this.timer);
    if (!this.state.playing) this.timer = window.setTimeout(() => this.record(), CALM);
  }

  /** Back by a step; false where there is none. */
  undo(): boolean {
    return this.step(this.past, this.future);
  }

  /** Forward again. */
  redo(): boolean {
    return this.step(this.future, this.past);
  }

  /** The last of one list is shown, and what was shown joins the other. */
  private step(from: string[], to: string[]): boolean {
    this.record();
    const step = from.pop();
    if (step === undefined) return false;
    to.push(this.now);
    return this.show(step);
  }

  private record(): void {
    window.clearTimeout(this.timer);
    const now = stepOf(this.state);
    if (now === this.now) return;
    this.past.push(this.now);
    if (this.past.length > MOST) this.past.shift();
    this.future.length = 0;
    this.now = now;
  }

  private show(step: string): boolean {
    this.now = step;
    Object.assign(this.state, { ball: undefined }, JSON.parse(step));
    this.state.playing = false;
    this.state.selected = Math.min(Math.max(this.state.selected, 0), this.state.lights.length - 1);
    return true;
  }
}

function stepOf({ lights, surfaces, ball, exposure, tone, terms }: State): string {
  return JSON.stringify({ lights, surfaces, ball, exposure, tone, terms } satisfies Step);
}
