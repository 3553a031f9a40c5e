export type { PluginOptions } from "./plugin";
export { SrbfRelightingMap, Z_UP_FROM_LEFT_HANDED } from "./relighting_map";
