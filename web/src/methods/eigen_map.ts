/** Eigen maps: scalar coefficient maps of RGB light functions, four per stored layer. */
import { checkCoefficientMaps, readCoefficientMaps } from "../coefficient_maps";
import shader from "../shaders/eigen_map.glsl";
import type { Method } from "./method";

export const eigenMap: Method = {
  name: "eigen-map",
  layersKey: "planes",
  layerChannels: 4,
  mapsPerLayer: 4,
  mapsName: "components",
  filterable: () => true,
  shader,
  check: checkCoefficientMaps,
  read: (files, manifest) => readCoefficientMaps(files, manifest),
};
