export { type ProbeNodesOptions, SrbfProbeNodes } from "./probes";
export { type RelightingNodesOptions, SrbfRelightingNodes } from "./relighting_nodes";
