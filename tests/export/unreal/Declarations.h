// SPDX-License-Identifier: MIT
// As much of Unreal's interfaces as SrbfRelit and SrbfSurfelLights use, written by hand so that a compiler without Unreal reads it. Nothing of it runs: a function
// that compiles here and is missing or other in Unreal would not be found.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

#define UCLASS(...)
#define USTRUCT(...)
#define UPROPERTY(...)
#define UFUNCTION(...)
#define GENERATED_BODY()
#define TEXT(text) text
#define UE_LOG(category, level, ...) FLog::Write(__VA_ARGS__)
#define TCHAR_TO_UTF8(text) (text)
#define UTF8_TO_TCHAR(text) (text)

using TCHAR = char;
using uint8 = uint8_t;
using int32 = int32_t;
struct FString { FString(const char* = "") {} const char* operator*() const { return ""; } template <typename... T> static FString Printf(const char*, T...) { return {}; } };
struct FLog { template <typename... T> static void Write(const char*, T...) {} };
struct FVector { double X = 0, Y = 0, Z = 0; FVector() {} FVector(double, double, double) {} FVector operator*(double) const { return *this; } FVector operator+(const FVector&) const { return *this; } };
struct FRotator {};
struct FMatrix { FRotator Rotator() const { return {}; } };
struct FRotationMatrix { static FMatrix MakeFromXZ(const FVector&, const FVector&) { return {}; } };
struct FLinearColor { float R = 1, G = 1, B = 1, A = 1; FLinearColor() {} FLinearColor(float, float, float, float = 1) {} static const FLinearColor White; FLinearColor operator*(float) const { return *this; } bool operator==(const FLinearColor&) const { return true; } };
template <typename T> struct TArray { T* begin() { return nullptr; } T* end() { return nullptr; } T* GetData() { return nullptr; } int32 Num() const { return 0; } int32 Add(const T&) { return 0; } void Swap(int32, int32) {} T& operator[](int32) { static T one; return one; } };
template <typename K, typename V> struct TPair { K Key; V Value; };
template <typename K, typename V> struct TMap { V Only; V& FindOrAdd(const K&) { return Only; } TPair<K, V>* begin() const { return nullptr; } TPair<K, V>* end() const { return nullptr; } };
struct UObject { virtual ~UObject() = default; struct UWorld* GetWorld() const { return nullptr; } };
template <typename T> T* NewObject(UObject*) { return nullptr; }
template <typename T> T* LoadObject(UObject*, const char*) { return nullptr; }
template <typename T, typename F> T* Cast(F* from) { return dynamic_cast<T*>(from); }
template <typename T> struct TObjectIterator { explicit operator bool() const { return false; } void operator++() {} T* operator->() const { return nullptr; } T* operator*() const { return nullptr; } };
enum ELevelTick { LEVELTICK_All };
struct FActorComponentTickFunction { bool bCanEverTick = false; };
struct UTexture : UObject {};
struct UMaterialInterface : UObject {};
struct UMaterialInstanceDynamic : UMaterialInterface { void SetTextureParameterValue(const char*, UTexture*) {} void SetVectorParameterValue(const char*, const FLinearColor&) {} UTexture* K2_GetTextureParameterValue(const char*) { return nullptr; } static UMaterialInstanceDynamic* Create(UMaterialInterface*, UObject*) { return nullptr; } };
struct AActor : UObject { template <typename T> void GetComponents(TArray<T*>&) const {} };
struct UActorComponent : UObject
{
    FActorComponentTickFunction PrimaryComponentTick;
    AActor* GetOwner() const { return nullptr; }
    void SetComponentTickEnabled(bool) {}
    void RegisterComponent() {}
    virtual void BeginPlay() {}
    virtual void TickComponent(float, ELevelTick, FActorComponentTickFunction*) {}
};
struct USceneComponent : UActorComponent { FVector GetComponentLocation() const { return {}; } FVector GetForwardVector() const { return {}; } void SetWorldLocationAndRotation(const FVector&, const FRotator&) {} bool IsVisible() const { return true; } };
struct UMeshComponent : USceneComponent { int32 GetNumMaterials() const { return 0; } UMaterialInstanceDynamic* CreateDynamicMaterialInstance(int32) { return nullptr; } };
struct ULightComponent : USceneComponent { float Intensity = 0; FLinearColor GetLightColor() const { return {}; } };
struct UPointLightComponent : ULightComponent {};
struct UDirectionalLightComponent : ULightComponent {};
struct USpotLightComponent : UPointLightComponent { float InnerConeAngle = 0, OuterConeAngle = 0; };
enum EPixelFormat { PF_A32B32G32R32F };
enum TextureFilter { TF_Nearest };
enum { LOCK_READ_WRITE };
struct FBulkData { void* Lock(int) { return nullptr; } void Unlock() {} };
struct FTexture2DMipMap { FBulkData BulkData; };
struct FTexturePlatformData { FTexture2DMipMap Mips[1]; };
struct UTexture2D : UTexture
{
    bool SRGB = true;
    TextureFilter Filter = TF_Nearest;
    static UTexture2D* CreateTransient(int32, int32, EPixelFormat) { return nullptr; }
    FTexturePlatformData* GetPlatformData() { return nullptr; }
    void UpdateResource() {}
};
struct FFileHelper { static bool LoadFileToArray(TArray<uint8>&, const char*) { return false; } };
struct FPaths { static FString ProjectContentDir() { return ""; } static FString Combine(const FString&, const FString&) { return ""; } };
struct FMemory { static void Memcpy(void* to, const void* from, size_t bytes) { std::memcpy(to, from, bytes); } };
struct FMath { static double DegreesToRadians(double degrees) { return degrees; } };
enum ETextureRenderTargetFormat { RTF_R32f, RTF_RGBA32f };
enum class ESceneCaptureSource { SCS_SceneDepth };
namespace ECameraProjectionMode { enum Type { Perspective, Orthographic }; }
struct UTextureRenderTarget2D : UTexture { int32 SizeX = 1, SizeY = 1; };
struct USceneCaptureComponent : USceneComponent { ESceneCaptureSource CaptureSource; bool bCaptureEveryFrame, bCaptureOnMovement; };
struct USceneCaptureComponent2D : USceneCaptureComponent
{
    ECameraProjectionMode::Type ProjectionType;
    float FOVAngle, OrthoWidth;
    UTextureRenderTarget2D* TextureTarget;
    void CaptureScene() {}
};
struct UKismetRenderingLibrary
{
    static UTextureRenderTarget2D* CreateRenderTarget2D(UObject*, int32, int32, ETextureRenderTargetFormat) { return nullptr; }
    static void ClearRenderTarget2D(UObject*, UTextureRenderTarget2D*, FLinearColor) {}
    static void DrawMaterialToRenderTarget(UObject*, UTextureRenderTarget2D*, UMaterialInterface*) {}
};
