export { type RelightingNodesOptions, SrbfRelightingNodes } from "./relighting_nodes";
