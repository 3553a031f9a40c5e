// SPDX-License-Identifier: MIT
// A component that computes the weights of named lights, or of a light cloud, once per frame, and sets them in an actor's materials.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include <set>
#include <string>
#include "SrbfWeights.h"
#include "SrbfRelit.generated.h"

class UTexture2D;

/** One of the scene's own lights: intensity 1 is as the scene has it set, 0 off; the color, linear, is on top of the scene's. */
USTRUCT(BlueprintType)
struct FSrbfNamedLight
{
    GENERATED_BODY()

    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    float Intensity = 1.0f;

    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    FLinearColor Color = FLinearColor::White;
};

/**
 * Add it to the actor whose mesh has the material Relit. An asset of named lights has its own: SetLight. A light cloud follows the level's point
 * and spot lights, in candelas, any number at the cost of one; a spot's bounces are approximate, see SrbfWeights::FluxShare. Other lights add
 * none. The engine's lights and shadows are the direct light.
 */
UCLASS(ClassGroup = (Srbf), meta = (BlueprintSpawnableComponent))
class USrbfRelit : public UActorComponent
{
    GENERATED_BODY()

public:
    USrbfRelit();

    /** Srbf/Srbf_….bin, which the import script puts below Content; list Srbf in "Additional Non-Asset Directories to Copy" of a package. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    FString Tables;

    /** Named lights that are not as the scene has them set. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Srbf")
    TMap<FString, FSrbfNamedLight> Mix;

    /** Dim, recolor or switch one of the scene's own lights; false, with a line in the log at the first time, where the asset has none of that name. */
    UFUNCTION(BlueprintCallable, Category = "Srbf")
    bool SetLight(const FString& Name, float Intensity, FLinearColor Color);

    virtual void BeginPlay() override;
    virtual void TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction) override;

private:
    SrbfWeights Weights;
    std::vector<float> Last;
    std::set<std::string> Warned;  // names that the log has

    UPROPERTY(Transient)
    UTexture2D* Texture = nullptr;

    void AddNamed();
    void AddLights();
    void Upload(const std::vector<float>& Texels);
};
