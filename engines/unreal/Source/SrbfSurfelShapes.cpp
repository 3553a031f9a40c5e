// SPDX-License-Identifier: MIT
// What enters without light on surfels: environments, objects that emit, objects that are repainted. Products of small matrices, in materials drawn into render targets.
#include "SrbfSurfelLights.h"

#include "Engine/Texture2D.h"
#include "Engine/TextureRenderTarget2D.h"
#include "Materials/MaterialInstanceDynamic.h"

namespace
{
constexpr int Radiances = 0, Lit = 1, Reflected = 2, Bounced = 3, Exchange = 4, Sums = 5, Powers = 7, Repainted = 9;  // of ShapeTargets; Sums and Powers: two each, drawn in turn
constexpr int CellsOf = 0, EnvironmentOf = 1, ProductOf = 2, ExchangeOf = 3, RepaintedOf = 4;                         // of ShapeMaterials
const TCHAR* const MaterialNames[] = {TEXT("SurfelCells"), TEXT("SurfelEnvironment"), TEXT("SurfelProduct"), TEXT("SurfelExchange"), TEXT("SurfelRepainted")};

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
    if (bKnown) Paint.FindOrAdd(Name) = Color;
    return bKnown;
}

bool USrbfSurfelLights::Changes(const FString& Name) const
{
    const bool bKnown = Known.Index(TCHAR_TO_UTF8(*Name)) >= 0;
    if (!bKnown) UE_LOG(LogTemp, Warning, TEXT("expected an object of an asset fitted with --editable, found %s"), *Name);
    return bKnown;
}

bool USrbfSurfelLights::MakeShapes()
{
    const int Rows = Known.Tables[0].Rows, Objects = int(Known.Names.size());
    for (int Name = 0; Name < 5; ++Name)
    {
        const bool bUsed = Name < ProductOf ? Known.Cells > 0 : Objects > 0;
        if (bUsed && !MakeMaterial(MaterialNames[Name], ShapeMaterials)) return false;
        if (!bUsed) ShapeMaterials.Add(nullptr);
    }
    const int Sizes[][2] = {{1, Known.Cells}, {1, Rows}, {1, Rows}, {1, Rows}, {Rows, Rows}, {Rows, Rows}, {Rows, Rows}, {Rows, Rows}, {Rows, Rows}, {Known.Count, Rows}};
    for (int Target = 0; Target < 10; ++Target)
    {
        const bool bUsed = Target <= Lit ? Known.Cells > 0 : Objects > 0;
        ShapeTargets.Add(bUsed ? MakeTarget(Sizes[Target][0], Sizes[Target][1], false) : nullptr);
    }
    Emitted = MakeNumbers(1, Rows);
    if (Objects > 0)
    {
        Albedo = MakeNumbers(2, Known.Count);
        One = MakeNumbers(Rows, Rows);
        std::vector<float> Identity(size_t(4 * Rows * Rows), 0.0f);
        for (size_t Row = 0; Row < size_t(Rows); ++Row)
            for (size_t Channel = 0; Channel < 3; ++Channel) Identity[4 * Row * size_t(Rows + 1) + Channel] = 1.0f;
        Upload(One, Identity);
    }
    return true;
}

std::vector<float> USrbfSurfelLights::Listed(const TMap<FString, FLinearColor>& Colors) const
{
    std::vector<float> Found(4 * Known.Names.size(), 0.0f);
    for (const TPair<FString, FLinearColor>& Entry : Colors)
    {
        const int Object = Known.Index(TCHAR_TO_UTF8(*Entry.Key));
        if (Object < 0) continue;
        const float Values[] = {Entry.Value.R, Entry.Value.G, Entry.Value.B, 1.0f};
        std::copy(Values, Values + 4, Found.begin() + 4 * Object);
    }
    return Found;
}

bool USrbfSurfelLights::DrawShapes()
{
    if (Environment != LastEnvironment && Environment != nullptr && Known.Cells == 0)
        UE_LOG(LogTemp, Warning, TEXT("expected an asset whose surfels see an environment, found one without; its scene is closed, or the asset is older: bake and fit again"));
    if (ShapeMaterials.Num() == 0)
    {
        LastEnvironment = Environment;
        return false;
    }
    const std::vector<float> Shining = Listed(Emission), Painted = Listed(Paint);
    const bool bNewPaint = Painted != LastPaint, bNewEnvironment = Environment != LastEnvironment || EnvironmentEnergy != LastEnergy;
    if (bShapesDrawn && Shining == LastEmission && !bNewPaint && !bNewEnvironment) return false;
    bShapesDrawn = true;
    LastEmission = Shining;
    LastPaint = Painted;
    LastEnvironment = Environment;
    LastEnergy = EnvironmentEnergy;
    if (bNewPaint) DrawPaint(Painted);
    std::vector<float> Radiance;
    for (size_t Value = 0; Value < Shining.size(); ++Value)
        if (Value % 4 < 3) Radiance.push_back(Shining[Value]);
    Upload(Emitted, Known.Emitted(Radiance, !bPainted));
    Added = Emitted;
    if (bPainted)
    {
        const int Rows = Known.Tables[0].Rows;
        DrawProduct(ProductOf, Reflected, Series, Emitted, Emitted, Matrix(Rows, 1, 0));
        DrawProduct(ProductOf, Bounced, ShapeTargets[Exchange], ShapeTargets[Reflected], Emitted, Matrix(Rows, 1, 1));
        Added = ShapeTargets[Bounced];
    }
    if (Environment != nullptr && Known.Cells > 0)
    {
        if (bPainted) UE_LOG(LogTemp, Warning, TEXT("expected the albedo of the bake under an environment, found objects that are repainted; its bounces are those of their own albedo"));
        UMaterialInstanceDynamic* Cells = ShapeMaterials[CellsOf];
        Cells->SetTextureParameterValue(TEXT("Environment"), Environment);
        Cells->SetVectorParameterValue(TEXT("Ahead"), Axis(Known.Direction(1, 0, 0), float(Known.Side)));
        Cells->SetVectorParameterValue(TEXT("Left"), Axis(Known.Direction(0, -1, 0), 0));
        Cells->SetVectorParameterValue(TEXT("Up"), Axis(Known.Direction(0, 0, 1), EnvironmentEnergy));
        DrawInto(ShapeTargets[Radiances], Cells);
        DrawProduct(EnvironmentOf, Lit, nullptr, ShapeTargets[Radiances], Added, Matrix(Known.Cells, Known.EnvironmentScale, 1));
        Added = ShapeTargets[Lit];
    }
    return true;
}

/** The exchange of light, then the sum of its powers, then the table. */
void USrbfSurfelLights::DrawPaint(const std::vector<float>& Painted)
{
    bPainted = false;
    for (size_t Object = 0; Object < Known.Names.size(); ++Object) bPainted = bPainted || (Painted[4 * Object + 3] > 0 && Known.Terms > 0);
    if (!bPainted) return;
    const int Rows = Known.Tables[0].Rows;
    Upload(Albedo, Known.Repainted(Painted));
    UMaterialInstanceDynamic* Material = ShapeMaterials[ExchangeOf];
    Material->SetTextureParameterValue(TEXT("Albedo"), Albedo);
    Material->SetVectorParameterValue(TEXT("Matrix"), Matrix(Known.Count, Known.ExchangeScale, Known.FeedbackScale));
    DrawInto(ShapeTargets[Exchange], Material);
    DrawSum();
    Material = ShapeMaterials[RepaintedOf];
    Material->SetTextureParameterValue(TEXT("Series"), Series);
    Material->SetTextureParameterValue(TEXT("Albedo"), Albedo);
    Material->SetVectorParameterValue(TEXT("Matrix"), Matrix(Rows, Known.GatherScale, Known.Tables[0].Scale));
    DrawInto(ShapeTargets[Repainted], Material);
    RepaintedTable = ShapeTargets[Repainted];
}

/** Powers of the exchange: of n terms 2n by sum + power sum, or n + 1 by one + exchange sum. Hundreds of terms take few passes. */
void USrbfSurfelLights::DrawSum()
{
    const int Rows = Known.Tables[0].Rows;
    const std::vector<bool> Steps = Known.Doublings();
    UTexture* Power = ShapeTargets[Exchange];
    Series = One;
    for (int Step = 0; Step < int(Steps.size()); ++Step)
    {
        const bool bDoubling = Steps[size_t(Step)];
        UTexture* Left = bDoubling ? Power : ShapeTargets[Exchange];
        DrawProduct(ProductOf, Sums + Step % 2, Left, Series, bDoubling ? Series : One, Matrix(Rows, 1, 1));
        Series = ShapeTargets[Sums + Step % 2];
        if (Step + 1 == int(Steps.size())) break;
        DrawProduct(ProductOf, Powers + Step % 2, Left, Power, One, Matrix(Rows, 1, 0));
        Power = ShapeTargets[Powers + Step % 2];
    }
}

/** `First` null: the material's own. */
void USrbfSurfelLights::DrawProduct(int Material, int Target, UTexture* First, UTexture* Second, UTexture* Addend, FLinearColor Numbers)
{
    UMaterialInstanceDynamic* Product = ShapeMaterials[Material];
    if (First != nullptr) Product->SetTextureParameterValue(TEXT("First"), First);
    Product->SetTextureParameterValue(TEXT("Second"), Second);
    Product->SetTextureParameterValue(TEXT("Addend"), Addend);
    Product->SetVectorParameterValue(TEXT("Matrix"), Numbers);
    DrawInto(ShapeTargets[Target], Product);
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
