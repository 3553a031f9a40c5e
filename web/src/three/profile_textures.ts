/** Profiles of lights as textures for `srbfProfile`, made when they are first asked for. */
import type { DataTexture } from "three";
import type { Profile } from "../light_profile";
import type { ProfileLook } from "../point_light";
import { floatTexture } from "./float_textures";

export class ProfileTextures {
  private readonly made = new Map<Profile, DataTexture>();

  /** Values of the uniforms that `srbfProfile` takes. */
  uniforms({ profile, across, up, tangent }: ProfileLook): { profile: DataTexture; profileAcross: number[]; profileUp: number[]; profileTangent: number } {
    let texture = this.made.get(profile);
    if (!texture) {
      texture = floatTexture(profile.texels(), profile.table.width, profile.table.height);
      this.made.set(profile, texture);
    }
    return { profile: texture, profileAcross: [...across], profileUp: [...up], profileTangent: tangent };
  }

  dispose(): void {
    for (const texture of this.made.values()) texture.dispose();
  }
}
