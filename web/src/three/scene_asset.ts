/** What both renderers' classes share: an asset with lights in a three.js scene. */
import { type Light as ThreeLight, Matrix4, type Texture } from "three";
import type { Asset } from "../asset";
import { inAssetFrame } from "../asset_frame";
import { SrbfError } from "../errors";
import { type EnvironmentLight, type Light, moved, namedLight } from "../lights";
import { asDesigned, put, setNamedLight } from "../named_lights";
import { multiplied, type Triple, Z_UP_FROM_Y_UP } from "../matrix";
import { type FrameValues, frameValues } from "../shader";
import type { ShapeLights } from "../shape_weights";
import { changeable } from "../surface_changes";
import { looksOf, type Placed, placed } from "../surfels";
import { environmentOf } from "./environment";
import { engineShadow, type ShadowedLook, type Shadowing } from "./engine_shadows";
import { rowsOf, threeMatrix } from "./rows";
import { checkKind, lightOf, type SceneLight } from "./scene_lights";

/** An asset, and the lights that shine on it: three's own by `follow`, in three's world, and those of the library in `lights`. */
export class SceneAsset {
  /** Lights of the library besides the followed ones, in the asset's world: Blender's, z up, meters. */
  readonly lights: Light[];
  /** Blender's z-up world from three's y-up one; compose it with the inverse of a group that moves the asset's objects. */
  readonly worldFromScene: Matrix4;
  private readonly followed: Set<SceneLight>;
  private environment?: { map: Texture; version: number; light: EnvironmentLight };

  /** `lightsOf`: the asset that has the lights and the place in the scene of this one. */
  constructor(
    readonly asset: Asset,
    lightsOf?: SceneAsset,
  ) {
    this.lights = lightsOf?.lights ?? [...asDesigned(asset)];
    this.followed = lightsOf?.followed ?? new Set();
    this.worldFromScene = lightsOf?.worldFromScene ?? threeMatrix(Z_UP_FROM_Y_UP);
  }

  /**
   * Dim, recolor or switch a light of the scene: `intensity` 1 as designed, as all are at first, 0 off; `color` linear Rec.709.
   *
   * @throws SrbfError on a name that the asset does not have.
   */
  setNamedLight(name: string, intensity = 1, color: Triple = [1, 1, 1]): this {
    setNamedLight(this.asset, this.lights, name, intensity, color);
    return this;
  }

  /**
   * Let an object emit radiance diffusely, linear Rec.709, with all bounces; 0 ends it. Of assets of transfer that were fitted with `--editable`.
   *
   * @throws SrbfError on an object that the asset does not have, and on other assets.
   */
  setEmission(name: string, radiance: Triple): this {
    changeable(this.asset.tables.surfaces).check(name);
    put(this.lights, namedLight(name, radiance));
    return this;
  }

  /**
   * Repaint an object, linear Rec.709 from 0 to 1, in all bounces off it; without a color it has its own again. Its material is yours. The asset in memory is
   * changed, for all that share it. @throws SrbfError as `setEmission`, and on an asset of radiance.
   */
  setAlbedo(name: string, color?: Triple): this {
    changeable(this.asset.tables.surfaces).setAlbedo(name, color);
    return this;
  }

  /**
   * Let an equirectangular map of three's shine from all around, `scene.environment` say, by its radiance times `intensity`, turned by `turn` as
   * `scene.environmentRotation.y` turns it (rad); none ends it. Bounces alone of an indirect asset: three adds what comes straight from the map.
   *
   * @throws SrbfError on other textures; `update` does on assets that know no environment.
   */
  setEnvironment(map?: Texture | null, intensity = 1, turn = 0): this {
    const others = this.lights.filter((light) => light.kind !== "environment");
    this.lights.splice(0, this.lights.length, ...others, ...(map ? [{ ...this.environmentLight(map), color: [intensity, intensity, intensity] as const, turn }] : []));
    return this;
  }

  /** A map that is set again and again, to turn it, is read once. */
  private environmentLight(map: Texture): EnvironmentLight {
    if (this.environment?.map !== map || this.environment.version !== map.version) this.environment = { map, version: map.version, light: environmentOf(map) };
    return this.environment.light;
  }

  /** Read three.js lights at every `update`. @throws SrbfError on kinds other than directional, point, spot and area. */
  follow(...lights: ThreeLight[]): this {
    for (const light of lights) {
      checkKind(light);
      this.followed.add(light);
    }
    return this;
  }

  unfollow(...lights: ThreeLight[]): this {
    for (const light of lights) this.followed.delete(light as SceneLight);
    return this;
  }

  /** All lights as lights of the library, in the asset's world. */
  currentLights(): Light[] {
    return [...this.lights, ...this.followedLights().map(([light]) => light)];
  }

  /** The followed lights that shine: in the asset's world, and as three has them. */
  protected followedLights(): [Light, SceneLight][] {
    const worldFromScene = rowsOf(this.worldFromScene);
    return [...this.followed].flatMap((own): [Light, SceneLight][] => {
      const light = lightOf(own);
      return light ? [[moved(light, worldFromScene), own]] : [];
    });
  }

  /** The points of each of the current lights, less `middle`, with the shadows that three has drawn of those that it has. */
  protected looks(renderer: Shadowing, middle: Triple): ShadowedLook[][] {
    const sceneFromAsset = () => this.assetFromScene().invert();
    const lights: [Light, SceneLight?][] = [...this.lights.map((light): [Light] => [light]), ...this.followedLights()];
    return lights.map(([light, own]) => {
      const shadow = own && engineShadow(own, renderer, sceneFromAsset);
      return placed(inAssetFrame(this.asset, [light])).flatMap((one) => looksOf(one, middle).map((look) => ({ ...look, shadow })));
    });
  }

  /** The current lights that lay irradiance on cells, as `looks` has them. */
  protected placed(): Placed[][] {
    return this.currentLights().map((light) => placed(inAssetFrame(this.asset, [light])));
  }

  /** The objects that emit, and environments. */
  protected shapeLights(): ShapeLights {
    return inAssetFrame(this.asset, this.lights.filter((light) => light.kind === "named" || light.kind === "environment"));
  }

  /** The current lights' numbers for shaders. */
  protected frame(): FrameValues {
    return frameValues(this.asset, this.currentLights());
  }

  /** Who adds the direct diffuse light of the scene's lights, unless a material says. */
  protected directOf({ direct }: { direct?: "asset" | "engine" }): "asset" | "engine" {
    return direct ?? (this.asset.manifest.transport === "indirect" ? "engine" : "asset");
  }

  /** From three's world to the asset's frame, meters. */
  protected assetFromScene(): Matrix4 {
    return threeMatrix(multiplied(this.asset.assetFromWorld, rowsOf(this.worldFromScene)));
  }
}

/** Where materials take the light from. @throws SrbfError on `maps` for layers that must not be filtered. */
export function sourceOf(asset: Asset, asked?: "maps" | "lightmap"): "maps" | "lightmap" {
  const { name } = asset.method;
  const filterable = asset.method.filterable(asset.manifest);
  if (!filterable && asked === "maps") {
    throw new SrbfError(`expected source "lightmap" for ${name}, found "maps": its layers must not be filtered between texels`);
  }
  return asked ?? (filterable ? "maps" : "lightmap");
}
