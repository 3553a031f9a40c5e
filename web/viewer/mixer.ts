/** A mixing desk of the scene's own lights: on or off, color and intensity of each, by name. Every control is a form element, for keyboards. */
import { isDesigned, type NamedState, namedState, round } from "./light_state";
import { chip } from "./messages";
import type { Changed, State } from "./state";

const MIDDLE = 100; // of the dial: intensity 1, as designed; the ends are 0 and 4
const MOST = 2 * MIDDLE;
const MANY = 12; // lights, from which on one can search
const ROWS = 200; // drawn at once

/** Fine near zero, as brightness is seen: intensity is the square of the dial's place. */
export const intensityAt = (place: number): number => round((place / MIDDLE) ** 2);
export const placeOf = (intensity: number): number => Math.min(MOST, Math.round(MIDDLE * Math.sqrt(Math.max(0, intensity))));

interface Row {
  light: NamedState;
  show(): void;
}

export class Mixer {
  private rows: Row[] = [];
  private shown: readonly NamedState[] = [];
  private sought = "";

  constructor(
    private readonly place: HTMLElement,
    private readonly state: State,
    private readonly changed: Changed,
  ) {}

  private get lights(): NamedState[] {
    return this.state.lights.filter((light) => light.kind === "named");
  }

  /** Draw the rows again if the lights are others, else their values. */
  refresh(): void {
    const { lights } = this;
    this.place.hidden = lights.length === 0;
    if (lights.length !== this.shown.length || lights.some((light, i) => light !== this.shown[i])) this.rebuild(lights);
    else for (const row of this.rows) row.show();
  }

  private rebuild(lights: readonly NamedState[]): void {
    this.shown = lights;
    const list = document.createElement("div");
    list.className = "rows";
    const buttons = document.createElement("div");
    buttons.className = "all";
    buttons.append(
      chip("All on", () => this.all(() => ({ on: true }))),
      chip("All off", () => this.all(() => ({ on: false }))),
      chip("As designed", () => this.all(({ name }) => namedState(name))),
    );
    this.place.replaceChildren(buttons, ...(lights.length > MANY ? [this.search(list)] : []), list);
    this.fill(list);
  }

  private fill(list: HTMLElement): void {
    const sought = this.shown.filter(({ name }) => name.toLowerCase().includes(this.sought.toLowerCase()));
    const made = sought.slice(0, ROWS).map((light) => this.row(light));
    this.rows = made.map(({ row }) => row);
    const rest = document.createElement("p");
    rest.textContent = sought.length > ROWS ? `${sought.length - ROWS} more: search by name` : sought.length ? "" : "no light has such a name";
    list.replaceChildren(...made.map(({ element }) => element), ...(rest.textContent ? [rest] : []));
  }

  private search(list: HTMLElement): HTMLElement {
    const input = document.createElement("input");
    input.type = "search";
    input.placeholder = `Find one of ${this.shown.length} lights`;
    input.setAttribute("aria-label", "Find a light");
    input.value = this.sought;
    input.oninput = () => {
      this.sought = input.value;
      this.fill(list);
    };
    return input;
  }

  private all(to: (light: NamedState) => Partial<NamedState>): void {
    for (const light of this.lights) Object.assign(light, to(light));
    this.touched();
  }

  private touched(): void {
    this.state.playing = false;
    this.changed({ lights: true });
  }

  private row(light: NamedState): { element: HTMLElement; row: Row } {
    const element = document.createElement("div");
    element.className = "row";
    element.setAttribute("role", "group");
    element.setAttribute("aria-label", light.name);
    const field = (type: string, what: string, set: (input: HTMLInputElement) => void) => {
      const input = document.createElement("input");
      input.type = type;
      input.setAttribute("aria-label", `${light.name}: ${what}`);
      input.oninput = () => {
        set(input);
        this.touched();
      };
      return input;
    };
    const on = field("checkbox", "on", (input) => (light.on = input.checked));
    const color = field("color", "color", (input) => (light.color = input.value));
    const dial = field("range", "intensity", (input) => (light.intensity = intensityAt(input.valueAsNumber)));
    Object.assign(dial, { min: "0", max: String(MOST), step: "1" });
    dial.ondblclick = () => {
      light.intensity = 1;
      this.touched();
    };
    const number = field("number", "intensity, a number", (input) => {
      if (input.valueAsNumber >= 0) light.intensity = round(input.valueAsNumber);
    });
    Object.assign(number, { min: "0", step: "any" });
    const name = document.createElement("span");
    name.textContent = name.title = light.name;
    element.append(on, color, name, number, dial);
    const show = () => {
      on.checked = light.on;
      color.value = light.color;
      dial.value = String(placeOf(light.intensity));
      dial.setAttribute("aria-valuetext", `${light.intensity} times as designed`);
      if (document.activeElement !== number || number.valueAsNumber !== light.intensity) number.value = String(Number(light.intensity.toPrecision(4)));
      element.classList.toggle("off", !light.on);
      element.classList.toggle("changed", !isDesigned(light));
    };
    show();
    return { element, row: { light, show } };
  }
}
