// SPDX-License-Identifier: MIT
// A component that lights surfels by the level's lights, in materials drawn into render targets, and sets the weights in an actor's materials.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include <set>
#include <string>
#include "SrbfSurfels.h"
#include "SrbfSurfelLights.generated.h"

class ULightComponent;
class UMaterialInstanceDynamic;
class USceneCaptureComponent2D;
class UTexture;
class UTexture2D;
class UTextureRenderTarget2D;

/**
 * Add it to the actor whose mesh has the material Relit, in place of SrbfRelit. It follows the level's point and spot lights, in candelas, and its directional
 * lights, in lux, any number at the cost of one per texel. Shadows are those of the asset's compressed depths, or else of captures of the scene's
 * depth: six per point or spot light, one per directional light, whenever a light has changed. Nothing is read back.
 */
UCLASS(ClassGroup = (Srbf), meta = (BlueprintSpawnableComponent))
class USrbfSurfelLights : public UActorComponent
{
    GENERATED_BODY()

public:
    USrbfSurfelLights();

    /** /Game/Srbf/Srbf_…, where the import script puts the materials; list /Game/Srbf in "Additional Asset Directories to Cook" of a package. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    FString Folder;

    /** Srbf/Srbf_…_surfels.bin, which the import script puts below Content; list Srbf in "Additional Non-Asset Directories to Copy" of a package. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    FString Surfels;

    /** Texels per side of a capture; a quarter of those of a directional light's. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    int32 ShadowSize = 256;

    /** Draw at every tick, for shadows of what moves; otherwise when a light has changed. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    bool bEveryTick = false;

    /** An equirectangular map as Blender has it, its middle at Unreal's +X, that shines through windows; radiance times energy. It must be a Texture2D or a render target. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    UTexture* Environment = nullptr;

    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    float EnvironmentEnergy = 1;

    /** Of an editable asset: radiance of objects that emit, and albedo of objects with another one. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    TMap<FString, FLinearColor> Emission;

    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    TMap<FString, FLinearColor> Albedo;

    /** Energy times color is the radiance; energy 0 ends it. False, with one warning, where no object of that name changes. */
    UFUNCTION(BlueprintCallable, Category = "Srbf")
    bool SetEmission(const FString& Name, float Energy, FLinearColor Color);

    /** In the bounces alone: materials are yours. An object has its own albedo again when it is removed from Albedo. */
    UFUNCTION(BlueprintCallable, Category = "Srbf")
    bool SetAlbedo(const FString& Name, FLinearColor Color);

    virtual void BeginPlay() override;
    virtual void TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction) override;

private:
    struct FLook
    {
        FLinearColor Light, Color, Axis, Shape;
        FVector Place, ToLight;

        bool operator==(const FLook& Other) const { return Light == Other.Light && Color == Other.Color && Axis == Other.Axis && Shape == Other.Shape; }
    };

    SrbfSurfels Known;
    std::vector<FLook> Last;
    bool bDrawn = false;

    UPROPERTY(Transient)
    TArray<UTextureRenderTarget2D*> Targets;  // irradiance, the former one, means, then parts and sums of each table, six faces, a directional map

    UPROPERTY(Transient)
    TArray<UMaterialInstanceDynamic*> Materials;  // irradiance, means, then parts and sums of each table

    UPROPERTY(Transient)
    TArray<UTextureRenderTarget2D*> EnvironmentTargets;

    UPROPERTY(Transient)
    TArray<UMaterialInstanceDynamic*> EnvironmentMaterials;  // none where no surfel sees an environment

    UPROPERTY(Transient)
    TArray<UTextureRenderTarget2D*> RepaintTargets;

    UPROPERTY(Transient)
    TArray<UMaterialInstanceDynamic*> RepaintMaterials;  // none until an object is repainted

    UPROPERTY(Transient)
    UTexture2D* Emitted = nullptr;  // a row for every row of the first table; null where the asset knows of neither an environment nor objects that change

    UPROPERTY(Transient)
    UTexture2D* AlbedoNumbers = nullptr;

    UPROPERTY(Transient)
    UTexture* OwnTable = nullptr;  // of the asset, from surfels to shapes

    UPROPERTY(Transient)
    UTexture2D* One = nullptr;  // the identity matrix

    UTexture* Added = nullptr;  // one of those above, as are the next two
    UTexture* Series = nullptr;
    UTexture* RepaintedTable = nullptr;
    UTexture* LastEnvironment = nullptr;
    float LastEnergy = 0;
    std::vector<float> LastEmission, LastAlbedo;
    bool bShapesDrawn = false, bRepainted = false, bRepaintingMade = false;
    std::set<std::string> Warned;  // what the log has

    UPROPERTY(Transient)
    USceneCaptureComponent2D* Capture = nullptr;

    UTextureRenderTarget2D* MakeTarget(int Width, int Height, bool bDepth);
    bool MakeMaterial(const FString& Name, TArray<UMaterialInstanceDynamic*>& Made);
    bool MakeShapes();
    bool MakeRepainting();
    bool Changes(const FString& Name);
    void Warn(const FString& Text);
    std::vector<float> Listed(const TMap<FString, FLinearColor>& Colors);
    bool DrawShapes();
    void Repaint(const std::vector<float>& Colors);
    void DrawSum();
    void DrawEnvironment();
    void Multiply(int Target, UTexture* Left, UTexture* Right, UTexture* Addend);
    void DrawProduct(UMaterialInstanceDynamic* Material, UTextureRenderTarget2D* Target, UTexture* Second, UTexture* Addend, FLinearColor Numbers);
    void DrawInto(UTextureRenderTarget2D* Target, UMaterialInstanceDynamic* Material);
    static UTexture2D* MakeNumbers(int Width, int Height);
    static void Upload(UTexture2D* Texture, const std::vector<float>& Texels);
    std::vector<FLook> Looks() const;
    void AddLook(const FLook& Look);
    void CaptureFaces(const FLook& Look);
    void Draw(int Target, int Material);
};
