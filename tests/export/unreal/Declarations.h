// SPDX-License-Identifier: MIT
// As much of Unreal's interfaces as SrbfRelit uses, written by hand so that a compiler without Unreal reads it. Nothing of it runs: a function
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

using uint8 = uint8_t;
using int32 = int32_t;
struct FString { FString(const char* = "") {} const char* operator*() const { return ""; } };
struct FLog { template <typename... T> static void Write(const char*, T...) {} };
struct FVector { double X = 0, Y = 0, Z = 0; };
struct FLinearColor { float R = 1, G = 1, B = 1, A = 1; static const FLinearColor White; FLinearColor operator*(float) const { return *this; } };
template <typename T> struct TArray { T* begin() { return nullptr; } T* end() { return nullptr; } T* GetData() { return nullptr; } int32 Num() const { return 0; } };
template <typename K, typename V> struct TPair { K Key; V Value; };
template <typename K, typename V> struct TMap { V Only; V& FindOrAdd(const K&) { return Only; } TPair<K, V>* begin() const { return nullptr; } TPair<K, V>* end() const { return nullptr; } };
struct UObject { virtual ~UObject() = default; struct UWorld* GetWorld() const { return nullptr; } };
template <typename T, typename F> T* Cast(F* from) { return dynamic_cast<T*>(from); }
template <typename T> struct TObjectIterator { explicit operator bool() const { return false; } void operator++() {} T* operator->() const { return nullptr; } T* operator*() const { return nullptr; } };
enum ELevelTick { LEVELTICK_All };
struct FActorComponentTickFunction { bool bCanEverTick = false; };
struct UTexture : UObject {};
struct UMaterialInstanceDynamic : UObject { void SetTextureParameterValue(const char*, UTexture*) {} };
struct AActor : UObject { template <typename T> void GetComponents(TArray<T*>&) const {} };
struct UActorComponent : UObject
{
    FActorComponentTickFunction PrimaryComponentTick;
    AActor* GetOwner() const { return nullptr; }
    void SetComponentTickEnabled(bool) {}
    virtual void BeginPlay() {}
    virtual void TickComponent(float, ELevelTick, FActorComponentTickFunction*) {}
};
struct USceneComponent : UActorComponent { FVector GetComponentLocation() const { return {}; } bool IsVisible() const { return true; } };
struct UMeshComponent : USceneComponent { int32 GetNumMaterials() const { return 0; } UMaterialInstanceDynamic* CreateDynamicMaterialInstance(int32) { return nullptr; } };
struct ULightComponent : USceneComponent { float Intensity = 0; FLinearColor GetLightColor() const { return {}; } };
struct UPointLightComponent : ULightComponent {};
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
