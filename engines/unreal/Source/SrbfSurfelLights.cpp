// SPDX-License-Identifier: MIT
#include "SrbfSurfelLights.h"

#include "Components/DirectionalLightComponent.h"
#include "Components/MeshComponent.h"
#include "Components/PointLightComponent.h"
#include "Components/SceneCaptureComponent2D.h"
#include "Components/SpotLightComponent.h"
#include "Engine/TextureRenderTarget2D.h"
#include "GameFramework/Actor.h"
#include "Kismet/KismetRenderingLibrary.h"
#include "Materials/MaterialInstanceDynamic.h"
#include "Misc/FileHelper.h"
#include "Misc/Paths.h"
#include "UObject/UObjectIterator.h"

namespace
{
constexpr int Irradiance = 0, Former = 1, Means = 2, FirstTable = 3;  // of Targets; a table has two, the faces follow
constexpr int LightCells = 0, MeanOfPatches = 1, FirstSum = 2;        // of Materials; a table has two
constexpr int MapSides = 4;                                           // sides of a face on one of a directional light's map
constexpr float Radius = 1e-4f;                                       // m

FLinearColor Four(const SrbfSurfels::Triple& V, double W) { return FLinearColor(float(V[0]), float(V[1]), float(V[2]), float(W)); }

FLinearColor Size(int Width, int Height) { return FLinearColor(float(Width), float(Height), 0.0f, 0.0f); }

FVector Vector(const SrbfSurfels::Triple& V) { return FVector(V[0], V[1], V[2]); }
}

USrbfSurfelLights::USrbfSurfelLights()
{
    PrimaryComponentTick.bCanEverTick = true;
}

void USrbfSurfelLights::BeginPlay()
{
    Super::BeginPlay();
    SetComponentTickEnabled(false);
    TArray<uint8> File;
    const FString Path = FPaths::Combine(FPaths::ProjectContentDir(), Surfels);
    if (!FFileHelper::LoadFileToArray(File, *Path))
    {
        UE_LOG(LogTemp, Error, TEXT("expected an export's surfels at %s, found none"), *Path);
        return;
    }
    const std::string Wrong = Known.Read(File.GetData(), size_t(File.Num()));
    if (!Wrong.empty())
    {
        UE_LOG(LogTemp, Error, TEXT("%s: %s"), *Path, UTF8_TO_TCHAR(Wrong.c_str()));
        return;
    }
    for (int Copy = 0; Copy < 2; ++Copy) Targets.Add(MakeTarget(Known.PlacesWidth, Known.PlacesHeight, false));
    Targets.Add(MakeTarget(Known.RangesWidth, Known.RangesHeight, false));
    bool bWhole = MakeMaterial(TEXT("SurfelIrradiance"), Materials) && MakeMaterial(TEXT("SurfelMeans"), Materials);
    for (size_t Table = 0; Table < Known.Tables.size(); ++Table)
    {
        const SrbfSurfelTable& Sizes = Known.Tables[Table];
        const auto Parts = SrbfSurfels::Square(Sizes.Rows * Sizes.Blocks());
        const bool bLast = Table + 1 == Known.Tables.size();
        const auto Sums = bLast ? std::array<int, 2>{Known.WeightsWidth, Known.WeightsHeight} : SrbfSurfels::Square(Sizes.Rows);
        Targets.Add(MakeTarget(Parts[0], Parts[1], false));
        Targets.Add(MakeTarget(Sums[0], Sums[1], false));
        bWhole = bWhole && MakeMaterial(FString::Printf(TEXT("SurfelParts%d"), int(Table)), Materials) && MakeMaterial(FString::Printf(TEXT("SurfelSums%d"), int(Table)), Materials);
    }
    if (bWhole && (Known.Cells > 0 || !Known.Names.empty())) bWhole = MakeShapes();
    if (!bWhole) return;
    OwnTable = Materials[FirstSum]->K2_GetTextureParameterValue(TEXT("Table"));
    if (Known.Groups == 0)
    {
        for (int Face = 0; Face < 7; ++Face) Targets.Add(MakeTarget((Face < 6 ? 1 : MapSides) * ShadowSize, (Face < 6 ? 1 : MapSides) * ShadowSize, true));
        Capture = NewObject<USceneCaptureComponent2D>(GetOwner());
        Capture->CaptureSource = ESceneCaptureSource::SCS_SceneDepth;
        Capture->bCaptureEveryFrame = false;
        Capture->bCaptureOnMovement = false;
        Capture->RegisterComponent();
    }
    TArray<UMeshComponent*> Meshes;
    GetOwner()->GetComponents(Meshes);
    for (UMeshComponent* Mesh : Meshes)
        for (int32 Slot = 0; Slot < Mesh->GetNumMaterials(); ++Slot)
            if (UMaterialInstanceDynamic* Material = Mesh->CreateDynamicMaterialInstance(Slot))
                Material->SetTextureParameterValue(TEXT("Weights"), Targets[FirstTable + 2 * int32(Known.Tables.size()) - 1]);
    SetComponentTickEnabled(true);
}

void USrbfSurfelLights::TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction)
{
    Super::TickComponent(DeltaTime, TickType, ThisTickFunction);
    const std::vector<FLook> Now = Looks();
    const bool bShapes = DrawShapes();
    if (bDrawn && !bEveryTick && !bShapes && Now == Last) return;
    bDrawn = true;
    Last = Now;
    UKismetRenderingLibrary::ClearRenderTarget2D(this, Targets[Irradiance], FLinearColor(0.0f, 0.0f, 0.0f, 0.0f));
    for (const FLook& Look : Now) AddLook(Look);
    Materials[MeanOfPatches]->SetTextureParameterValue(TEXT("Irradiance"), Targets[Irradiance]);
    Draw(Means, MeanOfPatches);
    int Numbers = Means;
    for (size_t Table = 0; Table < Known.Tables.size(); ++Table)
    {
        const SrbfSurfelTable& Sizes = Known.Tables[Table];
        const int Parts = FirstTable + 2 * int(Table), Sums = Parts + 1, Material = FirstSum + 2 * int(Table);
        const bool bOtherAlbedo = bRepainted && Table == 0;
        const FLinearColor Entries(float(Sizes.Rows), float(Sizes.Columns), float(Sizes.Blocks()), bOtherAlbedo ? 1.0f : float(Sizes.Scale));
        for (int Pass = 0; Pass < 2; ++Pass) Materials[Material + Pass]->SetVectorParameterValue(TEXT("Entries"), Entries);
        if (Table == 0) Materials[Material]->SetTextureParameterValue(TEXT("Table"), bOtherAlbedo ? RepaintedTable : OwnTable);
        if (Table == 0 && Emitted != nullptr) Materials[Material + 1]->SetTextureParameterValue(TEXT("Added"), Added);
        Materials[Material]->SetTextureParameterValue(TEXT("Numbers"), Targets[Numbers]);
        Draw(Parts, Material);
        Materials[Material + 1]->SetTextureParameterValue(TEXT("Parts"), Targets[Parts]);
        Draw(Sums, Material + 1);
        Numbers = Sums;
    }
}

UTextureRenderTarget2D* USrbfSurfelLights::MakeTarget(int Width, int Height, bool bDepth)
{
    return UKismetRenderingLibrary::CreateRenderTarget2D(this, Width, Height, bDepth ? RTF_R32f : RTF_RGBA32f);
}

bool USrbfSurfelLights::MakeMaterial(const FString& Name, TArray<UMaterialInstanceDynamic*>& Made)
{
    const FString Path = FString::Printf(TEXT("%s/%s.%s"), *Folder, *Name, *Name);
    UMaterialInterface* Material = LoadObject<UMaterialInterface>(nullptr, *Path);
    if (Material == nullptr) UE_LOG(LogTemp, Error, TEXT("expected the material %s, found none; run import_srbf.py again"), *Path);
    if (Material != nullptr) Made.Add(UMaterialInstanceDynamic::Create(Material, this));
    return Material != nullptr;
}

std::vector<USrbfSurfelLights::FLook> USrbfSurfelLights::Looks() const
{
    std::vector<FLook> Found;
    for (TObjectIterator<ULightComponent> Light; Light; ++Light)
    {
        const UPointLightComponent* Point = Cast<UPointLightComponent>(*Light);  // spot lights are point lights
        const USpotLightComponent* Spot = Cast<USpotLightComponent>(*Light);
        const bool bDistant = Cast<UDirectionalLightComponent>(*Light) != nullptr;
        if (Light->GetWorld() != GetWorld() || !Light->IsVisible() || (Point == nullptr && !bDistant)) continue;
        const FVector Place = Light->GetComponentLocation(), Forward = Light->GetForwardVector();
        const SrbfSurfels::Triple Toward = Known.Direction(-Forward.X, -Forward.Y, -Forward.Z);
        FLook Look;
        Look.Place = Place;
        Look.ToLight = FVector(-Forward.X, -Forward.Y, -Forward.Z);
        Look.Light = bDistant ? Four(Toward, 1) : Four(Known.Place(Place.X, Place.Y, Place.Z), 0);
        Look.Color = Light->GetLightColor() * Light->Intensity;
        Look.Axis = Four({-Toward[0], -Toward[1], -Toward[2]}, 0);
        const double Unit = Known.MetersPerUnit() * 100;  // candelas are lux at 1 m of the world
        Look.Shape = FLinearColor(float(Unit), Radius, 3.0f, 4.0f);
        if (Spot != nullptr)
        {
            Look.Shape.B = float(SrbfSurfels::Versine(FMath::DegreesToRadians(double(Spot->InnerConeAngle))));
            Look.Shape.A = float(SrbfSurfels::Versine(FMath::DegreesToRadians(double(Spot->OuterConeAngle))));
        }
        Found.push_back(Look);
    }
    return Found;
}

void USrbfSurfelLights::AddLook(const FLook& Look)
{
    UMaterialInstanceDynamic* Material = Materials[LightCells];
    FLinearColor Space(float(Known.Lift), float(Known.Far), float(Known.Groups), 0.0f);
    if (Known.Groups == 0)
    {
        CaptureFaces(Look);
        Space = FLinearColor(float(Known.Lift), float(Known.Reach), float(Known.MetersPerUnit()), 0.0f);
        const auto Frame = SrbfSurfels::Frame({Look.Light.R, Look.Light.G, Look.Light.B});
        Material->SetVectorParameterValue(TEXT("Across"), Four(Frame[0], 0));
        Material->SetVectorParameterValue(TEXT("Up"), Four(Frame[1], 0));
    }
    Targets.Swap(Irradiance, Former);
    Material->SetTextureParameterValue(TEXT("Former"), Targets[Former]);
    Material->SetVectorParameterValue(TEXT("Light"), Look.Light);
    Material->SetVectorParameterValue(TEXT("Color"), Look.Color);
    Material->SetVectorParameterValue(TEXT("Axis"), Look.Axis);
    Material->SetVectorParameterValue(TEXT("Shape"), Look.Shape);
    Material->SetVectorParameterValue(TEXT("Space"), Space);
    Draw(Irradiance, LightCells);
}

void USrbfSurfelLights::CaptureFaces(const FLook& Look)
{
    const bool bDistant = Look.Light.A > 0.5f;
    const float Side = float(2.0 * Known.Reach / Known.MetersPerUnit());  // of a directional light's map
    const FVector Middle = Vector(Known.UnrealMiddle());
    for (int Face = 0; Face < (bDistant ? 1 : 6); ++Face)
    {
        const auto Axes = bDistant ? SrbfSurfels::Frame({Look.Light.R, Look.Light.G, Look.Light.B}) : SrbfSurfels::Face(Face);
        const FVector Ahead = Vector(Known.UnrealDirection(Axes[2])), Down = Vector(Known.UnrealDirection(Axes[1]));
        UTextureRenderTarget2D* Target = Targets[FirstTable + 2 * int32(Known.Tables.size()) + (bDistant ? 6 : Face)];
        Capture->ProjectionType = bDistant ? ECameraProjectionMode::Orthographic : ECameraProjectionMode::Perspective;
        Capture->OrthoWidth = Side;
        Capture->FOVAngle = 90.0f;
        Capture->TextureTarget = Target;
        Capture->SetWorldLocationAndRotation(bDistant ? Middle + Look.ToLight * Side : Look.Place, FRotationMatrix::MakeFromXZ(Ahead, Down * -1.0).Rotator());
        Capture->CaptureScene();
        Materials[LightCells]->SetTextureParameterValue(*FString::Printf(TEXT("Face%d"), Face), Target);
    }
}

void USrbfSurfelLights::Draw(int Target, int Material)
{
    DrawInto(Targets[Target], Materials[Material]);
}

void USrbfSurfelLights::DrawInto(UTextureRenderTarget2D* Target, UMaterialInstanceDynamic* Material)
{
    Material->SetVectorParameterValue(TEXT("Size"), Size(Target->SizeX, Target->SizeY));
    UKismetRenderingLibrary::DrawMaterialToRenderTarget(this, Target, Material);
}
