// SPDX-License-Identifier: MIT
// Data of the passes that light surfels: sizes of their targets, and lights in the asset's frame. Standard C++ only, without Unreal's types; it reads the
// SrbfSurfels.bin of an export.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

struct SrbfSurfelTable
{
    int Rows = 0, Columns = 0;
    double Scale = 1;

    /// Parts that a row's sum is split into.
    int Blocks() const { return std::max(1, (Columns + 63) / 64); }
};

class SrbfSurfels
{
public:
    using Triple = std::array<double, 3>;

    int PlacesWidth = 0, PlacesHeight = 0;    // of the irradiance on cells
    int RangesWidth = 0, RangesHeight = 0;    // of the means of patches
    int WeightsWidth = 0, WeightsHeight = 0;  // as the asset's material takes them
    int Groups = 0;                           // texels per cell of compressed depths; 0: shadows by captures of the scene
    double Far = 0, Reach = 0, Lift = 0;      // m
    std::vector<SrbfSurfelTable> Tables;
    int Cells = 0, Side = 0;  // of the environment that surfels see; cells per side of the octahedral map of directions
    double EnvironmentScale = 0;
    std::vector<std::string> Names;  // of objects that change
    int Count = 0, Terms = 0;        // surfels; powers of the exchange of light that are summed
    double ExchangeScale = 0, GatherScale = 0, FeedbackScale = 0;

    /// A file in memory; an empty text, or what was expected and found.
    std::string Read(const uint8_t* Data, size_t Size)
    {
        At = Data;
        End = Data + Size;
        if (Size < 8 || std::memcmp(Data, "SRBFSRF2", 8) != 0) return "expected what srbf knows of surfels, found another file; export again";
        At += 8;
        Fill(AssetFromWorld, 16);
        Fill(Middle, 3);
        for (double* Value : {&Reach, &Lift, &Far}) Fill(Value, 1);
        for (int* Value : {&PlacesWidth, &PlacesHeight, &RangesWidth, &RangesHeight, &WeightsWidth, &WeightsHeight, &Groups}) *Value = Int();
        const int TableCount = Int();
        for (int Table = 0; Table < TableCount && At != nullptr; ++Table)
        {
            Tables.emplace_back();
            Tables.back().Rows = Int();
            Tables.back().Columns = Int();
            Fill(&Tables.back().Scale, 1);
        }
        ReadShapes();
        return At == End ? "" : "expected what srbf knows of surfels, found a file of another size; export again";
    }

    /// -1 where no object of that name changes.
    int Index(const std::string& Name) const
    {
        const auto Found = std::find(Names.begin(), Names.end(), Name);
        return Found == Names.end() ? -1 : int(Found - Names.begin());
    }

    /// RGBA for every row of the first table: what objects of these radiances, RGB of each, add; with all bounces, or without.
    std::vector<float> Emitted(const std::vector<float>& Radiances, bool bBounced) const
    {
        const int Rows = Tables.empty() ? 0 : Tables[0].Rows;
        const std::vector<float>& Of = bBounced ? Emission : First;
        std::vector<float> Added(size_t(4 * Rows), 0.0f);
        for (size_t Object = 0; Object < Names.size(); ++Object)
            for (int Row = 0; Row < Rows; ++Row)
                for (size_t Channel = 0; Channel < 3; ++Channel)
                    Added[4 * size_t(Row) + Channel] += Radiances[3 * Object + Channel] * Of[3 * (Object * size_t(Rows) + size_t(Row)) + Channel];
        return Added;
    }

    /// How the sum of Terms powers is made of the first: a step doubles the terms where true, and adds one where false.
    std::vector<bool> Doublings() const
    {
        std::vector<bool> Steps;
        for (int Left = Terms; Left > 1; Left /= 2)
        {
            if (Left % 2 == 1) Steps.insert(Steps.begin(), false);
            Steps.insert(Steps.begin(), true);
        }
        return Steps;
    }

    /// RGBA of every surfel: its albedo where objects have others, RGB and 1 of each, and that of the bake.
    std::vector<float> Repainted(const std::vector<float>& Colors) const
    {
        std::vector<float> Both(size_t(8 * Count), 0.0f);
        for (size_t Surfel = 0; Surfel < size_t(Count); ++Surfel)
            for (size_t Channel = 0; Channel < 3; ++Channel)
            {
                const float Own = Albedo[3 * Surfel + Channel];
                float Now = Own;
                for (size_t Object = 0; Object < Names.size(); ++Object)
                    if (Colors[4 * Object + 3] > 0) Now += Shares[Object * size_t(Count) + Surfel] * (Limited(Colors[4 * Object + Channel]) - Own);
                Both[8 * Surfel + Channel] = Limited(Now);
                Both[8 * Surfel + 4 + Channel] = Own;
            }
        return Both;
    }

    /// A place of Unreal's world (cm, left-handed) in the asset's frame, less the middle of the cells (m).
    Triple Place(double X, double Y, double Z) const
    {
        Triple Found = Turned(X * 0.01, Y * -0.01, Z * 0.01);
        for (int Axis = 0; Axis < 3; ++Axis) Found[Axis] += AssetFromWorld[4 * Axis + 3] - Middle[Axis];
        return Found;
    }

    /// A direction of Unreal's world in the asset's frame, unit.
    Triple Direction(double X, double Y, double Z) const { return Unit(Turned(X, -Y, Z)); }

    /// A direction of the asset's frame in Unreal's world, unit.
    Triple UnrealDirection(const Triple& V) const
    {
        Triple Found{};
        for (int Axis = 0; Axis < 3; ++Axis)
            for (int Row = 0; Row < 3; ++Row) Found[Axis] += AssetFromWorld[4 * Row + Axis] * V[Row];
        return Unit({Found[0], -Found[1], Found[2]});
    }

    /// The middle of the cells in Unreal's world, cm.
    Triple UnrealMiddle() const
    {
        Triple Found{};
        const double Square = Scale() * Scale();
        for (int Axis = 0; Axis < 3; ++Axis)
            for (int Row = 0; Row < 3; ++Row) Found[Axis] += AssetFromWorld[4 * Row + Axis] * (Middle[Row] - AssetFromWorld[4 * Row + 3]) / Square;
        return {Found[0] * 100, Found[1] * -100, Found[2] * 100};
    }

    /// The asset's meters per unit of Unreal.
    double MetersPerUnit() const { return Scale() * 0.01; }

    /// Columns, rows and the way that face 0 to 5 of a cube looks, +x, -x, +y, -y, +z, -z of the asset's frame.
    static std::array<Triple, 3> Face(int Face)
    {
        const int Axis = Face / 2;
        return {Along(Axis + 1, 1), Along(Axis + 2, 1), Along(Axis, Face % 2 == 0 ? 1 : -1)};
    }

    /// Columns and rows of a directional light's map, and the way that its capture looks.
    static std::array<Triple, 3> Frame(const Triple& ToLight)
    {
        const Triple Across = Unit(Cross(std::abs(ToLight[2]) < 0.9 ? Triple{0, 0, 1} : Triple{1, 0, 0}, ToLight));
        return {Across, Cross(ToLight, Across), {-ToLight[0], -ToLight[1], -ToLight[2]}};
    }

    /// 1 - cos of an angle (rad).
    static double Versine(double Angle) { return 2 * std::pow(std::sin(Angle / 2), 2); }

    /// Sides of a texture of so many texels, about as high as wide.
    static std::array<int, 2> Square(int Count)
    {
        const int Width = std::max(1, int(std::ceil(std::sqrt(double(Count)))));
        return {Width, std::max(1, (Count + Width - 1) / Width)};
    }

private:
    double AssetFromWorld[16] = {}, Middle[3] = {};
    const uint8_t *At = nullptr, *End = nullptr;
    std::vector<float> Emission, First, Shares, Albedo;

    void ReadShapes()
    {
        Cells = Int();
        Side = Int();
        Fill(&EnvironmentScale, 1);
        const int Objects = Int();
        Count = Int();
        Terms = Int();
        for (double* Value : {&ExchangeScale, &GatherScale, &FeedbackScale}) Fill(Value, 1);
        for (int Object = 0; Object < Objects && At != nullptr; ++Object)
        {
            const int Size = Int();
            if (At == nullptr || Size < 0 || Size > End - At) { At = nullptr; return; }
            Names.emplace_back(reinterpret_cast<const char*>(At), size_t(Size));
            At += Size;
        }
        if (At == nullptr || Objects == 0 || Tables.empty()) return;
        const size_t Weights = 3 * size_t(Objects) * size_t(Tables[0].Rows);
        const size_t Sizes[] = {Weights, Weights, size_t(Objects) * size_t(Count), 3 * size_t(Count)};
        std::vector<float>* const Lists[] = {&Emission, &First, &Shares, &Albedo};
        for (int List = 0; List < 4 && At != nullptr; ++List)
        {
            if (Sizes[List] > size_t(End - At) / sizeof(float)) { At = nullptr; return; }
            Lists[List]->resize(Sizes[List]);
            Fill(Lists[List]->data(), Sizes[List]);
        }
    }

    static float Limited(float Share) { return std::max(0.0f, std::min(0.99f, Share)); }  // what a bounce keeps at most

    int Int()
    {
        int32_t Value = 0;
        Fill(&Value, 1);
        return Value;
    }

    template <typename T>
    void Fill(T* Target, size_t Count)
    {
        if (At == nullptr || Count > size_t(End - At) / sizeof(T)) At = nullptr;
        else std::memcpy(Target, At, Count * sizeof(T)), At += Count * sizeof(T);
    }

    Triple Turned(double X, double Y, double Z) const
    {
        Triple Found{};
        for (int Axis = 0; Axis < 3; ++Axis) Found[Axis] = AssetFromWorld[4 * Axis] * X + AssetFromWorld[4 * Axis + 1] * Y + AssetFromWorld[4 * Axis + 2] * Z;
        return Found;
    }

    double Scale() const { return std::sqrt(std::pow(AssetFromWorld[0], 2) + std::pow(AssetFromWorld[4], 2) + std::pow(AssetFromWorld[8], 2)); }

    static Triple Along(int Axis, double Value)
    {
        Triple Found{};
        Found[Axis % 3] = Value;
        return Found;
    }

    static Triple Cross(const Triple& A, const Triple& B)
    {
        return {A[1] * B[2] - A[2] * B[1], A[2] * B[0] - A[0] * B[2], A[0] * B[1] - A[1] * B[0]};
    }

    static Triple Unit(const Triple& V)
    {
        const double Length = std::max(1e-30, std::sqrt(V[0] * V[0] + V[1] * V[1] + V[2] * V[2]));
        return {V[0] / Length, V[1] / Length, V[2] / Length};
    }
};
