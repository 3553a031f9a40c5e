// SPDX-License-Identifier: MIT
// The weights of a frame from the lights: named ones by their colors, or lights inside the scene by their places. Standard C++ alone, no
// types of Unreal; it reads the SrbfTables.bin of an export.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

class SrbfWeights
{
public:
    int Rows = 0, Columns = 0;       // of the texture of weights: a row per cluster, the mean's weight first; of maps one row
    bool Cloud = false;              // lights by place, or else by name
    std::vector<std::string> Names;  // of named lights, UTF-8

    /// The tables of a file in memory; an empty text, or what was expected and found.
    std::string Read(const uint8_t* Data, size_t Size)
    {
        At = Data;
        End = Data + Size;
        if (Size < 8 || std::memcmp(Data, "SRBFTAB1", 8) != 0) return "expected tables of srbf, found another file; export again";
        At += 8;
        Cloud = Int() == 1;
        Rows = Int();
        Columns = Int();
        if (Cloud) ReadCloud();
        else ReadNamed();
        if (At == nullptr || At != End) return "expected whole tables of srbf, found a file of another size; export again";
        Begin();
        return "";
    }

    /// Index of a name, or -1.
    int Index(const std::string& Name) const
    {
        const auto Found = std::find(Names.begin(), Names.end(), Name);
        return Found == Names.end() ? -1 : int(Found - Names.begin());
    }

    /// Forget all lights. Named ones are as the scene has them until they are set.
    void Begin() { Mixed.assign(3 * (Cloud ? Rank : int(Names.size())), Cloud ? 0.0 : 1.0); }

    /// A named light's linear color times intensity: 1 is as the scene has it, 0 off.
    void Set(int Light, double Red, double Green, double Blue)
    {
        Mixed[3 * Light] = Red;
        Mixed[3 * Light + 1] = Green;
        Mixed[3 * Light + 2] = Blue;
    }

    /// A point light at (X, Y, Z) m of Blender's world; its color is the irradiance at 1 m, linear. Whether it sees a node: elsewhere, as in a
    /// wall, its weights are those of the nodes around.
    bool Add(double X, double Y, double Z, double Red, double Green, double Blue)
    {
        const double World[4] = {X, Y, Z, 1};
        double Place[3] = {};
        for (int Row = 0; Row < 3; ++Row)
            for (int Column = 0; Column < 4; ++Column) Place[Row] += AssetFromWorld[4 * Row + Column] * World[Column];
        const double Unit = Scale() * Scale();  // the asset's meters
        const double Color[3] = {Red * Unit, Green * Unit, Blue * Unit};
        int Corners[8];
        double Shares[8];
        const bool Inside = Find(Place, Corners, Shares);
        for (int Corner = 0; Corner < 8; ++Corner)
            for (int Axis = 0; Axis < Rank && Shares[Corner] != 0; ++Axis)
                for (int Channel = 0; Channel < 3; ++Channel)
                    Mixed[3 * Axis + Channel] += Color[Channel] * Shares[Corner] * Nodes[size_t(Rank) * Corners[Corner] + Axis];
        return Inside;
    }

    /// RGBA of every texel of the weights, row by row, A = 1: one small product, whatever the number of lights.
    std::vector<float> Texels() const
    {
        const size_t Functions = size_t(Rows) * Columns, Count = Mixed.size() / 3;
        std::vector<double> Sums(3 * Functions, 0.0);
        if (Values.empty()) std::copy(Mixed.begin(), Mixed.end(), Sums.begin());  // a map each
        for (size_t Row = 0; Row < (Values.empty() ? 0 : Count); ++Row)
            for (size_t Function = 0; Function < Functions; ++Function)
                for (size_t Channel = 0; Channel < 3; ++Channel)
                {
                    const size_t Value = Cloud ? Row * Functions + Function : Function * Count + Row;
                    Sums[3 * Function + Channel] += Mixed[3 * Row + Channel] * Values[3 * Value + Channel];
                }
        std::vector<float> Found(4 * Functions, 1.0f);
        for (size_t Function = 0; Function < Functions; ++Function)
            for (size_t Channel = 0; Channel < 3; ++Channel) Found[4 * Function + Channel] = float(Sums[3 * Function + Channel]);
        return Found;
    }

    /// The share of a point light's flux that a spot of these half-angles (rad) sends out; its smooth edge lets half through. With it a spot
    /// is followed as a point light, a rough approximation: the bounces lack the cone's direction. In a small room they are off by 0.4 for a
    /// half-angle of 45 degrees, by 0.6 for 20 (relative rms).
    static double FluxShare(double Inner, double Outer)
    {
        return (std::pow(std::sin(Inner / 2), 2) + std::pow(std::sin(Outer / 2), 2)) / 2;
    }

private:
    double AssetFromWorld[16] = {}, Origin[3] = {}, Spacing = 1;
    int Grid[3] = {}, Fine = 0, Rank = 0;
    std::vector<float> Nodes, Values;  // Rank numbers of a node; RGB by function and light, or by axis and function
    std::vector<uint8_t> Seen;
    std::vector<double> Mixed;  // RGB of every light, or of every axis
    const uint8_t *At = nullptr, *End = nullptr;

    static constexpr double LeastSeen = 1e-4;  // sum of its cell's weights below which a light sees no node

    void ReadNamed()
    {
        const int Count = Int();
        for (int Light = 0; Light < Count && At != nullptr; ++Light)
        {
            const std::vector<char> Name = Many<char>(Int());
            Names.emplace_back(Name.begin(), Name.end());
        }
        if (Int() != 0) Values = Many<float>(size_t(3) * Rows * Columns * Names.size());
    }

    void ReadCloud()
    {
        Fill(AssetFromWorld, 16);
        Fill(Origin, 3);
        Fill(&Spacing, 1);
        Fill(Grid, 3);
        Fine = Int();
        Rank = Int();
        Nodes = Many<float>(size_t(Grid[0]) * Grid[1] * Grid[2] * Rank);
        Values = Many<float>(size_t(3) * Rank * Rows * Columns);
        Seen = Many<uint8_t>(size_t(8) * Fine * Fine * Fine * (Grid[0] - 1) * (Grid[1] - 1) * (Grid[2] - 1));
    }

    int Int()
    {
        int32_t Value = 0;
        Fill(&Value, 1);
        return Value;
    }

    template <typename T>
    std::vector<T> Many(size_t Count)
    {
        if (At == nullptr || Count > size_t(End - At) / sizeof(T)) Count = 0, At = nullptr;
        std::vector<T> Found(Count);
        Fill(Found.data(), Count);
        return Found;
    }

    template <typename T>
    void Fill(T* Target, size_t Count)
    {
        if (At == nullptr || Count > size_t(End - At) / sizeof(T)) At = nullptr;
        else if (Count > 0) std::memcpy(Target, At, Count * sizeof(T)), At += Count * sizeof(T);
    }

    double Scale() const
    {
        const double* M = AssetFromWorld;
        const double Volume = M[0] * (M[5] * M[10] - M[6] * M[9]) - M[1] * (M[4] * M[10] - M[6] * M[8]) + M[2] * (M[4] * M[9] - M[5] * M[8]);
        return std::cbrt(std::abs(Volume));
    }

    /// The eight nodes about a place of the asset's frame, and their weights.
    bool Find(const double* Place, int* Corners, double* Shares) const
    {
        int Cell[3], Low[3];
        double Part[3], Between[3], Amounts[8] = {}, Total = 0;
        for (int Axis = 0; Axis < 3; ++Axis)
        {
            const double Step = std::min(std::max((Place[Axis] - Origin[Axis]) / Spacing, 0.0), double(Grid[Axis] - 1));
            Cell[Axis] = std::min(int(Step), Grid[Axis] - 2);
            Part[Axis] = Step - Cell[Axis];
            const int First = Cell[Axis] * Fine;
            const double FineStep = std::min(std::max(Step * Fine - 0.5, double(First)), double(First + Fine - 1));  // of the light's own cell
            Low[Axis] = std::min(int(FineStep), First + Fine - 2);
            Between[Axis] = FineStep - Low[Axis];
        }
        const int Row = 8 * Fine * (Grid[0] - 1);
        for (int Corner = 0; Corner < 8; ++Corner)
        {
            const int Y = (Low[2] + (Corner >> 2)) * Fine * (Grid[1] - 1) + Low[1] + (Corner >> 1 & 1);
            const uint8_t* Bytes = Seen.data() + size_t(Y) * Row + 8 * (Low[0] + (Corner & 1));
            for (int Other = 0; Other < 8; ++Other) Amounts[Other] += Share(Corner, Between) * Bytes[Other] / 255.0;
        }
        for (int Corner = 0; Corner < 8; ++Corner)
        {
            Corners[Corner] = ((Cell[2] + (Corner >> 2)) * Grid[1] + Cell[1] + (Corner >> 1 & 1)) * Grid[0] + Cell[0] + (Corner & 1);
            Shares[Corner] = Share(Corner, Part);
            Total += Shares[Corner] * Amounts[Corner];
        }
        for (int Corner = 0; Corner < 8 && Total >= LeastSeen; ++Corner) Shares[Corner] *= Amounts[Corner] / Total;
        return Total >= LeastSeen;
    }

    static double Share(int Corner, const double* Part)
    {
        double Found = 1;
        for (int Axis = 0; Axis < 3; ++Axis) Found *= (Corner >> Axis & 1) ? Part[Axis] : 1 - Part[Axis];
        return Found;
    }
};
