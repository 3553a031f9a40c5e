/** The methods that assets can have: the only list of them. */
import { clusteredEigenMap } from "./clustered_eigen_map";
import { eigenMap } from "./eigen_map";
import type { Method } from "./method";
import { relightingMap } from "./relighting_map";

export const METHODS: readonly Method[] = [relightingMap, eigenMap, clusteredEigenMap];

export function methodNamed(name: unknown): Method | undefined {
  return METHODS.find((method) => method.name === name);
}
