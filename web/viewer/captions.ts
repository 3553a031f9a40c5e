/** Text beside the picture: title, status, the selected light's direction, and the legend of false colors. */
import type { Light, Triple } from "../src";
import type { Comparison } from "./comparison";
import type { CyclesTold } from "./cycles";
import type { Facts } from "./loading";
import type { COLORS } from "./screen";
import type { State } from "./state";
import type { Subject } from "./subject";

/** The scene's name, and its asset in one line. */
export function titles(place: HTMLElement, facts: Facts, { asset }: Subject): void {
  const { manifest, method, tables } = asset;
  const many = `${tables.maps} ${method.mapsName}`;
  const name = document.createElement("h1");
  name.textContent = facts.title;
  const line = document.createElement("p");
  line.textContent = [manifest.method.replaceAll("-", " "), many, `${manifest.width} × ${manifest.height} ${facts.kind === "view" ? "pixels" : "texels"}`, manifest.quantity].join(" · ");
  place.replaceChildren(name, line);
}

/** Frame time (`pace`, ms, once it is known), memory, what is compared, and which light the picture lacks; `missing`: lights of the scene that are not shown. */
export function statusLine(place: HTMLElement, subject: Subject, comparison: Comparison, shining: readonly Light[], { terms }: State, pace?: number, missing = "", cycles?: CyclesTold): void {
  const { asset, facts, hasDirect } = subject;
  const { compared, error } = comparison;
  const parts = [
    `<b>${pace === undefined ? "–" : pace.toFixed(1)}</b> ms per frame`,
    `<b>${(facts.resident_bytes / 2 ** 20).toFixed(1)}</b> MiB of asset on the GPU, <b>${facts.bytes_per_texel}</b> bytes per texel`,
  ];
  if (compared >= 0) parts.push(`baked light <b>${compared}</b> (${comparison.role})${error ? `, rmse <b>${error}</b>` : ""}`);
  if (cycles?.line) parts.push(cycles.line);
  if (cycles?.isOld) parts.push("lights have changed since: render again");
  else if (cycles?.error) parts.push(`relative rmse <b>${(100 * cycles.error.relative).toPrecision(3)} %</b>, psnr <b>${cycles.error.psnr.toFixed(1)}</b> dB, page <b>${cycles.relitIn.toFixed(0)}</b> ms`);
  if (asset.manifest.transport === "indirect") {
    if (!hasDirect || compared >= 0 || terms === "indirect") parts.push("indirect light only");
    else if (shining.some((light) => light.kind === "environment")) parts.push("environments: indirect light only");
  }
  place.innerHTML = parts.map((part) => `<span>${part}</span>`).join("");
  if (!missing) return;
  const told = document.createElement("span"); // names are the scene's: text, not markup
  told.textContent = missing;
  place.append(told);
}

/** A directional light's azimuth and elevation; `inside`: whether it lies in the captured domain. */
export function bearing(place: HTMLElement, direction: Triple | undefined, inside: boolean): void {
  if (place.hidden) return;
  if (!direction) {
    place.textContent = "drag on the disc to add a directional light";
    return;
  }
  const [x, y, z] = direction;
  const elevation = (Math.asin(Math.min(1, Math.max(-1, z / Math.hypot(x, y, z)))) * 180) / Math.PI;
  const azimuth = ((Math.atan2(y, x) * 180) / Math.PI + 360) % 360;
  place.classList.toggle("warn", !inside);
  place.textContent = `azimuth ${azimuth.toFixed(1)}°, elevation ${elevation.toFixed(1)}°${inside ? "" : " · outside the captured domain"}`;
}

/** The slider between a reference and the picture, `at` of the width. */
export function slider(place: HTMLElement, shown: boolean, at: number): void {
  place.hidden = !shown;
  for (const child of place.children) (child as HTMLElement).style.left = `${at * 100}%`;
  (place.querySelector("i") as HTMLElement).ariaValueNow = String(Math.round(100 * at));
}

/** What false colors mean, up to `most`; hidden for a picture in true colors. */
export function legend(place: HTMLElement, color: keyof typeof COLORS, most: number): void {
  const text = (x: number) => String(Number(x.toPrecision(3)));
  place.hidden = color !== "magnitude" && color !== "signed" && color !== "negative";
  if (place.hidden) return;
  const bars = {
    magnitude: ["linear-gradient(90deg,#30123b,#4668e0,#1bcfd4,#61fc6c,#d1e834,#fe9b2d,#d93806,#7a0402)", "0", "luminance", text(most)],
    signed: ["linear-gradient(90deg,#d9f0ff,#2e80ff,#121315,#ff4729,#ffedcc)", text(-most), "0", text(most)],
    negative: ["linear-gradient(90deg,#590d6b,#ff59ff)", "0", "below 0, clamped", text(-most / 8)],
  } as const;
  const [bar, left, middle, right] = bars[color as keyof typeof bars];
  place.innerHTML = `<i style="background:${bar}"></i><div><span>${left}</span><span>${middle}</span><span>${right}</span></div>`;
}
