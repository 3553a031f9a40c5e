// SPDX-License-Identifier: MIT
// Environments, emissive objects and changed albedo: products of small matrices, in materials drawn into render targets.
#include "SrbfSurfelLights.h"

#include "Engine/Texture2D.h"
#include "Engine/TextureRenderTarget2D.h"
#include "Materials/MaterialInstanceDynamic.h"

namespace
{
constexpr int Radiances = 0, Lit = 1;                                                         // of EnvironmentTargets
constexpr int CellsOf = 0, EnvironmentOf = 1;                                                 // of EnvironmentMaterials
constexpr int Reflected = 0, Bounced = 1, Exchange = 2, Sums = 3, Powers = 5, Repainted = 7;  // of RepaintTargets; Sums and Powers: two each, drawn in turn
constexpr int ProductOf = 0, ExchangeOf = 1, RepaintedOf = 2;                                 // of RepaintMaterials

FLinearColor Matrix(int Columns, double Scale, double Added) { return FLinearColor(float(Columns), float(Scale), float(Added), 0.0f); }

FLinearColor Axis(const SrbfSurfels::Triple& V, float W) { return FLinearColor(float(V[0]), float(V[1]), float(V[2]), W); }
}

bool USrbfSurfelLights::SetEmission(const FString& Name, float Energy, FLinearColor Color)
{
    const bool bKnown = Changes(Name);
    if (bKnown) Emission.FindOrAdd(Name) = Color * Energy;
    return bKnown;
}

bool USrbfSurfelLights::SetAlbedo(const FString& Name, FLinearColor Color)
{
    const bool bKnown = Changes(Name);
    if (bKnown) Albedo.FindOrAdd(Name) = Color;
    return bKnown;
}

bool USrbfSurfelLights::Changes(const FString& Name)
{
    const bool bKnown = Known.Index(TCHAR_TO_UTF8(*Name)) >= 0;
    if (!bKnown) Warn(FString::Printf(TEXT("expected an object of an asset fitted with --editable, found %s"), *Name));
    return bKnown;
}

/** Each text once, since it may be found in every tick. */
void USrbfSurfelLights::Warn(const FString& Text)
{
    if (Warned.insert(TCHAR_TO_UTF8(*Text)).second) UE_LOG(LogTemp, Warning, TEXT("%s"), *Text);
}

bool USrbfSurfelLights::MakeShapes()
{
    const int Rows = Known.Tables[0].Rows;
    Emitted = MakeNumbers(1, Rows);
    if (Known.Cells == 0) return true;
    for (const int Height : {Known.Cells, Rows}) EnvironmentTargets.Add(MakeTarget(1, Height, false));
    return MakeMaterial(TEXT("SurfelCells"), EnvironmentMaterials) && MakeMaterial(TEXT("SurfelEnvironment"), EnvironmentMaterials);
}

/** At the first object that is repainted: the targets and the textures of the materials take much memory. */
bool USrbfSurfelLights::MakeRepainting()
{
    if (bRepaintingMade) return RepaintTargets.Num() > 0;
    bRepaintingMade = true;
    for (const TCHAR* Name : {TEXT("SurfelProduct"), TEXT("SurfelExchange"), TEXT("SurfelRepainted")})
        if (!MakeMaterial(Name, RepaintMaterials)) return false;
    const int Rows = Known.Tables[0].Rows;
    for (int Target = 0; Target < Repainted; ++Target) RepaintTargets.Add(MakeTarget(Target < Exchange ? 1 : Rows, Rows, false));
    RepaintTargets.Add(MakeTarget(Known.Count, Rows, false));
    AlbedoNumbers = MakeNumbers(2, Known.Count);
    One = MakeNumbers(Rows, Rows);
    std::vector<float> Identity(size_t(4 * Rows * Rows), 0.0f);
    for (size_t Row = 0; Row < size_t(Rows); ++Row)
        for (size_t Channel = 0; Channel < 3; ++Channel) Identity[4 * Row * size_t(Rows + 1) + Channel] = 1.0f;
    Upload(One, Identity);
    return true;
}

std::vector<float> USrbfSurfelLights::Listed(const TMap<FString, FLinearColor>& Colors)
{
    std::vector<float> Found(4 * Known.Names.size(), 0.0f);
    for (const TPair<FString, FLinearColor>& Entry : Colors)
    {
        if (!Changes(Entry.Key)) continue;
        const int Object = Known.Index(TCHAR_TO_UTF8(*Entry.Key));
        const float Values[] = {Entry.Value.R, Entry.Value.G, Entry.Value.B, 1.0f};
        std::copy(Values, Values + 4, Found.begin() + 4 * Object);
    }
    return Found;
}

bool USrbfSurfelLights::DrawShapes()
{
    if (Environment != nullptr && Known.Cells == 0)
        Warn(TEXT("expected an asset whose surfels see an environment, found one without; its scene is closed, or the asset is older: bake and fit again"));
    if (Emitted == nullptr) return false;
    const std::vector<float> Emitters = Listed(Emission), Colors = Listed(Albedo);
    const bool bNewAlbedo = Colors != LastAlbedo, bNewEnvironment = Environment != LastEnvironment || EnvironmentEnergy != LastEnergy;
    if (bShapesDrawn && Emitters == LastEmission && !bNewAlbedo && !bNewEnvironment) return false;
    bShapesDrawn = true;
    LastEmission = Emitters;
    LastAlbedo = Colors;
    LastEnvironment = Environment;
    LastEnergy = EnvironmentEnergy;
    if (bNewAlbedo) Repaint(Colors);
    std::vector<float> Radiance;
    for (size_t Value = 0; Value < Emitters.size(); ++Value)
        if (Value % 4 < 3) Radiance.push_back(Emitters[Value]);
    Upload(Emitted, Known.Emitted(Radiance, !bRepainted));
    Added = Emitted;
    if (bRepainted)
    {
        Multiply(Reflected, Series, Emitted, nullptr);
        Multiply(Bounced, RepaintTargets[Exchange], RepaintTargets[Reflected], Emitted);
        Added = RepaintTargets[Bounced];
    }
    if (Environment != nullptr && Known.Cells > 0) DrawEnvironment();
    return true;
}

void USrbfSurfelLights::DrawEnvironment()
{
    if (bRepainted) Warn(TEXT("expected the albedo of the bake under an environment, found objects that are repainted; its bounces are those of their own albedo"));
    UMaterialInstanceDynamic* Cells = EnvironmentMaterials[CellsOf];
    Cells->SetTextureParameterValue(TEXT("Environment"), Environment);
    Cells->SetVectorParameterValue(TEXT("Ahead"), Axis(Known.Direction(1, 0, 0), float(Known.Side)));
    Cells->SetVectorParameterValue(TEXT("Left"), Axis(Known.Direction(0, -1, 0), 0));
    Cells->SetVectorParameterValue(TEXT("Up"), Axis(Known.Direction(0, 0, 1), EnvironmentEnergy));
    DrawInto(EnvironmentTargets[Radiances], Cells);
    DrawProduct(EnvironmentMaterials[EnvironmentOf], EnvironmentTargets[Lit], EnvironmentTargets[Radiances], Added, Matrix(Known.Cells, Known.EnvironmentScale, 1));
    Added = EnvironmentTargets[Lit];
}

/** The exchange of light, then the sum of its powers, then the table. */
void USrbfSurfelLights::Repaint(const std::vector<float>& Colors)
{
    bRepainted = false;
    for (size_t Object = 0; Object < Known.Names.size(); ++Object) bRepainted = bRepainted || (Colors[4 * Object + 3] > 0 && Known.Terms > 0);
    bRepainted = bRepainted && MakeRepainting();
    if (!bRepainted) return;
    const int Rows = Known.Tables[0].Rows;
    Upload(AlbedoNumbers, Known.Repainted(Colors));
    UMaterialInstanceDynamic* Material = RepaintMaterials[ExchangeOf];
    Material->SetTextureParameterValue(TEXT("Albedo"), AlbedoNumbers);
    Material->SetVectorParameterValue(TEXT("Matrix"), Matrix(Known.Count, Known.ExchangeScale, Known.FeedbackScale));
    DrawInto(RepaintTargets[Exchange], Material);
    DrawSum();
    Material = RepaintMaterials[RepaintedOf];
    Material->SetTextureParameterValue(TEXT("Series"), Series);
    Material->SetTextureParameterValue(TEXT("Albedo"), AlbedoNumbers);
    Material->SetVectorParameterValue(TEXT("Matrix"), Matrix(Rows, Known.GatherScale, Known.Tables[0].Scale));
    DrawInto(RepaintTargets[Repainted], Material);
    RepaintedTable = RepaintTargets[Repainted];
}

/** Powers of the exchange: of n terms 2n by sum + power sum, or n + 1 by one + exchange sum. Hundreds of terms take few passes. */
void USrbfSurfelLights::DrawSum()
{
    const std::vector<bool> Steps = Known.Doublings();
    UTexture* Power = RepaintTargets[Exchange];
    Series = One;
    for (int Step = 0; Step < int(Steps.size()); ++Step)
    {
        const bool bDoubling = Steps[size_t(Step)];
        UTexture* Left = bDoubling ? Power : RepaintTargets[Exchange];
        Multiply(Sums + Step % 2, Left, Series, bDoubling ? Series : One);
        Series = RepaintTargets[Sums + Step % 2];
        if (Step + 1 == int(Steps.size())) break;
        Multiply(Powers + Step % 2, Left, Power, nullptr);
        Power = RepaintTargets[Powers + Step % 2];
    }
}

/** Into a target of RepaintTargets, a product of matrices of a row per row of the first table; `Addend` null: nothing is added. */
void USrbfSurfelLights::Multiply(int Target, UTexture* Left, UTexture* Right, UTexture* Addend)
{
    RepaintMaterials[ProductOf]->SetTextureParameterValue(TEXT("First"), Left);
    DrawProduct(RepaintMaterials[ProductOf], RepaintTargets[Target], Right, Addend != nullptr ? Addend : One, Matrix(Known.Tables[0].Rows, 1, Addend != nullptr ? 1 : 0));
}

void USrbfSurfelLights::DrawProduct(UMaterialInstanceDynamic* Material, UTextureRenderTarget2D* Target, UTexture* Second, UTexture* Addend, FLinearColor Numbers)
{
    Material->SetTextureParameterValue(TEXT("Second"), Second);
    Material->SetTextureParameterValue(TEXT("Addend"), Addend);
    Material->SetVectorParameterValue(TEXT("Matrix"), Numbers);
    DrawInto(Target, Material);
}

UTexture2D* USrbfSurfelLights::MakeNumbers(int Width, int Height)
{
    UTexture2D* Made = UTexture2D::CreateTransient(Width, Height, PF_A32B32G32R32F);
    Made->SRGB = false;
    Made->Filter = TF_Nearest;
    return Made;
}

void USrbfSurfelLights::Upload(UTexture2D* Texture, const std::vector<float>& Texels)
{
    FTexture2DMipMap& Mip = Texture->GetPlatformData()->Mips[0];
    FMemory::Memcpy(Mip.BulkData.Lock(LOCK_READ_WRITE), Texels.data(), Texels.size() * sizeof(float));
    Mip.BulkData.Unlock();
    Texture->UpdateResource();
}
