// SPDX-License-Identifier: MIT
#include "SrbfRelit.h"

#include "Components/MeshComponent.h"
#include "Components/PointLightComponent.h"
#include "Components/SpotLightComponent.h"
#include "Engine/Texture2D.h"
#include "GameFramework/Actor.h"
#include "Materials/MaterialInstanceDynamic.h"
#include "Misc/FileHelper.h"
#include "Misc/Paths.h"
#include "UObject/UObjectIterator.h"

USrbfRelit::USrbfRelit()
{
    PrimaryComponentTick.bCanEverTick = true;
}

bool USrbfRelit::SetLight(const FString& Name, float Intensity, FLinearColor Color)
{
    if (Weights.Index(TCHAR_TO_UTF8(*Name)) < 0)
    {
        if (Warned.insert(TCHAR_TO_UTF8(*Name)).second) UE_LOG(LogTemp, Warning, TEXT("expected a light of the asset, found %s"), *Name);
        return false;
    }
    FSrbfNamedLight& Light = Mix.FindOrAdd(Name);
    Light.Intensity = Intensity;
    Light.Color = Color;
    return true;
}

void USrbfRelit::BeginPlay()
{
    Super::BeginPlay();
    TArray<uint8> File;
    const FString Path = FPaths::Combine(FPaths::ProjectContentDir(), Tables);
    if (!FFileHelper::LoadFileToArray(File, *Path))
    {
        UE_LOG(LogTemp, Error, TEXT("expected the tables of an export at %s, found none"), *Path);
        SetComponentTickEnabled(false);
        return;
    }
    const std::string Wrong = Weights.Read(File.GetData(), size_t(File.Num()));
    if (!Wrong.empty())
    {
        UE_LOG(LogTemp, Error, TEXT("%s: %s"), *Path, UTF8_TO_TCHAR(Wrong.c_str()));
        SetComponentTickEnabled(false);
        return;
    }
    Texture = UTexture2D::CreateTransient(Weights.Columns, Weights.Rows, PF_A32B32G32R32F);
    Texture->SRGB = false;
    Texture->Filter = TF_Nearest;
    TArray<UMeshComponent*> Meshes;
    GetOwner()->GetComponents(Meshes);
    for (UMeshComponent* Mesh : Meshes)
        for (int32 Slot = 0; Slot < Mesh->GetNumMaterials(); ++Slot)
            if (UMaterialInstanceDynamic* Material = Mesh->CreateDynamicMaterialInstance(Slot)) Material->SetTextureParameterValue(TEXT("Weights"), Texture);
}

void USrbfRelit::TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction)
{
    Super::TickComponent(DeltaTime, TickType, ThisTickFunction);
    if (Texture == nullptr) return;
    Weights.Begin();
    if (Weights.Cloud) AddLights();
    else AddNamed();
    const std::vector<float> Texels = Weights.Texels();
    if (Texels == Last) return;
    Last = Texels;
    Upload(Texels);
}

void USrbfRelit::AddNamed()
{
    for (const TPair<FString, FSrbfNamedLight>& Entry : Mix)
    {
        const int Light = Weights.Index(TCHAR_TO_UTF8(*Entry.Key));
        const FLinearColor Color = Entry.Value.Color * Entry.Value.Intensity;
        if (Light >= 0) Weights.Set(Light, Color.R, Color.G, Color.B);
    }
}

void USrbfRelit::AddLights()
{
    for (TObjectIterator<UPointLightComponent> Light; Light; ++Light)  // spot lights are point lights
    {
        if (Light->GetWorld() != GetWorld() || !Light->IsVisible()) continue;
        const USpotLightComponent* Spot = Cast<USpotLightComponent>(*Light);
        const double Share = Spot ? SrbfWeights::FluxShare(FMath::DegreesToRadians(double(Spot->InnerConeAngle)), FMath::DegreesToRadians(double(Spot->OuterConeAngle))) : 1.0;
        const FLinearColor Color = Light->GetLightColor() * (Light->Intensity * float(Share));
        const FVector Place = Light->GetComponentLocation();  // cm, left-handed
        Weights.Add(Place.X * 0.01, Place.Y * -0.01, Place.Z * 0.01, Color.R, Color.G, Color.B);
    }
}

void USrbfRelit::Upload(const std::vector<float>& Texels)
{
    FTexture2DMipMap& Mip = Texture->GetPlatformData()->Mips[0];
    FMemory::Memcpy(Mip.BulkData.Lock(LOCK_READ_WRITE), Texels.data(), Texels.size() * sizeof(float));
    Mip.BulkData.Unlock();
    Texture->UpdateResource();
}
