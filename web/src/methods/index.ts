/** The methods that assets can have: the only list of them. */
import { clusteredEigenMap } from "./clustered_eigen_map";
import { deepFramebuffer } from "./deep_framebuffer";
import { eigenMap } from "./eigen_map";
import { lightCloud } from "./light_cloud";
import { lightMix } from "./light_mix";
import type { Method } from "./method";
import { namedMaps } from "./named_maps";
import { neuralMap } from "./neural_map";
import { relightingMap } from "./relighting_map";
import { transfer } from "./transfer";

export const METHODS: readonly Method[] = [relightingMap, eigenMap, clusteredEigenMap, lightMix, namedMaps, lightCloud, transfer, deepFramebuffer, neuralMap];

export function methodNamed(name: unknown): Method | undefined {
  return METHODS.find((method) => method.name === name);
}
