/** The color of a black body by its temperature. */
export const [COLDEST, HOTTEST] = [1700, 20_000]; // K, within the range of the fit

/** sRGB #rrggbb of a black body at `kelvin`, its largest channel 255; chromaticity by the cubic fit of Kim et al. 2002, out-of-gamut colors cut. */
export function temperatureColor(kelvin: number): string {
  const t = 1e3 / Math.min(HOTTEST, Math.max(COLDEST, kelvin));
  const x = kelvin < 4000 ? ((-0.2661239 * t - 0.234358) * t + 0.8776956) * t + 0.17991 : ((-3.0258469 * t + 2.1070379) * t + 0.2226347) * t + 0.24039;
  const fit = kelvin < 2222 ? [-1.1063814, -1.3481102, 2.18555832, -0.20219683] : kelvin < 4000 ? [-0.9549476, -1.37418593, 2.09137015, -0.16748867] : [3.081758, -5.8733867, 3.75112997, -0.37001483];
  const y = fit.reduce((sum, factor) => sum * x + factor, 0);
  const [X, Z] = [x / y, (1 - x - y) / y];
  const linear = [3.2404542 * X - 1.5371385 - 0.4985314 * Z, -0.969266 * X + 1.8760108 + 0.041556 * Z, 0.0556434 * X - 0.2040259 + 1.0572252 * Z].map((c) => Math.max(0, c));
  const most = Math.max(...linear);
  const byte = (c: number) => Math.round(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055));
  return `#${linear.map((c) => byte(c / most).toString(16).padStart(2, "0")).join("")}`;
}
