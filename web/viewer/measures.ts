/** What the server measures of an asset when it is asked for: the error of every captured light, and spectra. */
import type { Comparison } from "./comparison";
import type { DirectionWidget } from "./direction_widget";
import { element, lineOf, say } from "./messages";
import { SpectrumPlot } from "./spectrum";
import type { State } from "./state";
import type { Subject } from "./subject";

/** What the page does while one waits. */
export interface Waiting {
  wait(): void;
  done(): void;
  changed(): void;
}

export class Measures {
  private readonly plot = new SpectrumPlot(element<HTMLCanvasElement>("spectrum"));
  private shown?: Subject;
  private asking?: Subject; // whose errors are being measured
  private plotted?: Subject; // whose spectrum is drawn

  constructor(
    private readonly state: State,
    private readonly comparison: Comparison,
    private readonly directions: DirectionWidget,
    private readonly waiting: Waiting,
  ) {}

  /** Errors and spectrum of a subject, where the state asks for them; the lights that they are of are `placed` or directions. */
  show(subject: Subject, placed: boolean): void {
    this.shown = subject;
    this.showErrors(subject, placed);
    this.showSpectrum(subject);
  }

  private showErrors(subject: Subject, placed: boolean): void {
    if (!this.state.errors) {
      this.directions.errors = undefined;
      return;
    }
    if (this.directions.errors || this.asking === subject) return;
    this.asking = subject;
    this.waiting.wait();
    say("measuring every light's error …", "hint");
    this.comparison
      .errors(subject)
      .then(({ psnr, texels }) => {
        if (this.shown !== subject) return;
        this.directions.errors = psnr;
        const [worst, best] = [Math.min(...psnr), Math.max(...psnr)].map((value) => value.toFixed(1));
        say(placed ? `PSNR of every captured point light over ${texels} texels: ${worst} dB red to ${best} dB blue` : `PSNR of every baked light over ${texels} texels; rings mark held-out lights`, "hint");
        this.waiting.changed();
      })
      .catch((error) => {
        this.state.errors = false;
        say(lineOf(error));
      })
      .finally(() => {
        this.asking = undefined;
        this.waiting.done();
      });
  }

  private showSpectrum(subject: Subject): void {
    element("spectrum").hidden = !this.state.spectrum;
    if (!this.state.spectrum || this.plotted === subject) return;
    this.plotted = subject;
    this.waiting.wait();
    this.plot
      .draw(subject)
      .catch((error) => {
        this.plotted = undefined;
        this.state.spectrum = false;
        say(lineOf(error));
      })
      .finally(() => this.waiting.done());
  }
}
