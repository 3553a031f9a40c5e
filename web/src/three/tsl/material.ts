/** An asset's light in node materials. */
import { IrradianceNode, BasicLightMapNode, LightingNode, type NodeMaterial } from "three/webgpu";
import { vec3, vec4 } from "three/tsl";
import { SrbfError } from "../../errors";
import type { N } from "./nodes";

/** Adds irradiance as a light map does, and removes the direct diffuse light that was added before. */
class ReplacingIrradianceNode extends LightingNode {
  constructor(private readonly light: N) {
    super();
  }

  override setup(builder: N): null {
    builder.context.reflectedLight.directDiffuse.assign(vec3(0));
    builder.context.irradiance.addAssign(this.light);
    return null;
  }
}

/** Irradiance adds as a lightMap does (outgoing = albedo * E / pi), radiance replaces the outgoing light. @throws SrbfError on unlit materials other than Basic. */
export function applyLight(material: NodeMaterial, light: N, quantity: "irradiance" | "radiance", replaceDirect: boolean, alpha?: N): void {
  if (alpha !== undefined) {
    material.transparent = true;
    material.opacityNode = alpha;
  }
  if (quantity === "radiance") {
    material.outputNode = vec4(light, alpha ?? 1);
  } else if ((material as { isMeshBasicNodeMaterial?: boolean }).isMeshBasicNodeMaterial) {
    material.setupLightMap = () => new BasicLightMapNode(light) as N;
  } else if (material.lights) {
    material.setupLightMap = () => (replaceDirect ? new ReplacingIrradianceNode(light) : new IrradianceNode(light)) as N;
  } else {
    throw new SrbfError(`expected a lit node material or MeshBasicNodeMaterial, found ${material.type}; use the node of light() in it yourself`);
  }
  material.needsUpdate = true;
}
