/** The panel's lists of the objects that a light shines on, and of those that shadow it. */
import type { Links, Objects } from "../src";
import { isChosen, isLinked, linksOf } from "../src/light_linking";
import type { LightState } from "./light_state";
import { chip } from "./messages";

const LISTS = { receivers: "Shines on", blockers: "Shadowed by" } as const;
const MANY = 12; // objects, from which on one can search
const LISTED = 3; // names in a closed list's line

const open = new Set<keyof Links>(); // lists, which stay so under other lights

/** The choice of some of the objects; undefined where they are all. */
export function choiceOf(chosen: ReadonlySet<string>, names: readonly string[]): Objects | undefined {
  const without = names.filter((name) => !chosen.has(name));
  if (!without.length) return undefined;
  return without.length < chosen.size ? { without } : { only: names.filter((name) => chosen.has(name)) };
}

/** What a closed list says. */
export function lineOf(choice: Objects | undefined, names: readonly string[]): string {
  if (!choice) return "all";
  const [on, off] = [true, false].map((side) => names.filter((name) => isChosen(choice, name) === side));
  if (!off.length) return "all";
  if (!on.length) return "nothing";
  const listed = (some: string[]) => some.slice(0, LISTED).join(", ") + (some.length > LISTED ? ` and ${some.length - LISTED} more` : "");
  return on.length <= off.length ? listed(on) : `all but ${listed(off)}`;
}

/** Both lists of a light, of the objects `names`, at the end of `place`. */
export function linkControls(place: HTMLElement, light: LightState, names: readonly string[], changed: () => void): void {
  for (const link of Object.keys(LISTS) as (keyof Links)[]) place.append(list(light, link, names, changed));
}

function list(light: LightState, link: keyof Links, names: readonly string[], changed: () => void): HTMLElement {
  const details = document.createElement("details");
  details.className = "links";
  details.open = open.has(link);
  details.ontoggle = () => void (details.open ? open.add(link) : open.delete(link));
  const [summary, line, rows] = [document.createElement("summary"), document.createElement("span"), document.createElement("div")];
  summary.append(LISTS[link], line);
  const boxes = new Map<string, HTMLInputElement>();
  const show = () => {
    const choice = light.links?.[link];
    line.textContent = line.title = lineOf(choice, names);
    for (const [name, box] of boxes) box.checked = !choice || isChosen(choice, name);
  };
  const choose = (chosen: ReadonlySet<string>) => {
    const links = linksOf({ ...light.links, [link]: choiceOf(chosen, names) });
    light.links = isLinked(links) ? links : undefined;
    show();
    changed();
  };
  for (const name of names) {
    const [row, box] = [document.createElement("label"), document.createElement("input")];
    box.type = "checkbox";
    box.onchange = () => choose(new Set(names.filter((one) => boxes.get(one)?.checked)));
    boxes.set(name, box);
    row.append(box, name);
    rows.append(row);
  }
  const all = document.createElement("div");
  all.className = "all";
  all.append(chip("All", () => choose(new Set(names))), chip("None", () => choose(new Set())));
  rows.className = "rows";
  details.append(summary, all, ...(names.length > MANY ? [search(rows)] : []), rows);
  show();
  return details;
}

function search(rows: HTMLElement): HTMLInputElement {
  const input = document.createElement("input");
  input.type = "search";
  input.placeholder = `Find one of ${rows.children.length} objects`;
  input.setAttribute("aria-label", "Find an object");
  input.oninput = () => {
    for (const row of rows.children as unknown as Iterable<HTMLElement>) row.hidden = !row.textContent?.toLowerCase().includes(input.value.toLowerCase());
  };
  return input;
}
