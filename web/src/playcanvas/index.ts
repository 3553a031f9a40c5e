export { type ShowOptions, SrbfRelightingMap } from "./relighting_map";
