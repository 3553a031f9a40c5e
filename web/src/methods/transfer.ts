/** Direct-to-indirect transfer: a light cloud whose weights come from the irradiance on surfels by way of a few shapes [Lehtinen2008]. */
import { lightCloud } from "./light_cloud";
import type { Method } from "./method";

export const transfer: Method = { ...lightCloud, name: "transfer" };
