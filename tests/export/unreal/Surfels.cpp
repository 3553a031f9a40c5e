// SPDX-License-Identifier: MIT
// Runs SrbfSurfels.h on an exported file and prints what it found, a name and numbers a line, for the tests to compare.
//   surfels FILE X Y Z   a place, and a direction, of Unreal's world
#include "SrbfSurfels.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

static void print(const char* name, const SrbfSurfels::Triple& v) { std::printf("%s %.17g %.17g %.17g\n", name, v[0], v[1], v[2]); }

int main(int, char** arguments)
{
    std::ifstream stream(arguments[1], std::ios::binary);
    const std::vector<char> file((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    SrbfSurfels surfels;
    const std::string wrong = surfels.Read(reinterpret_cast<const uint8_t*>(file.data()), file.size());
    if (!wrong.empty())
    {
        std::printf("refused %s\n", wrong.c_str());
        return 0;
    }
    const double x = std::atof(arguments[2]), y = std::atof(arguments[3]), z = std::atof(arguments[4]);
    std::printf("sizes %d %d %d %d %d %d %d\n", surfels.PlacesWidth, surfels.PlacesHeight, surfels.RangesWidth, surfels.RangesHeight, surfels.WeightsWidth, surfels.WeightsHeight, surfels.Groups);
    std::printf("meters %.17g %.17g %.17g %.17g\n", surfels.Reach, surfels.Lift, surfels.Far, surfels.MetersPerUnit());
    for (const SrbfSurfelTable& table : surfels.Tables) std::printf("table %d %d %.17g %d\n", table.Rows, table.Columns, table.Scale, table.Blocks());
    std::printf("environment %d %d %.17g\n", surfels.Cells, surfels.Side, surfels.EnvironmentScale);
    std::printf("changes %d %d %.17g %.17g %.17g\n", surfels.Count, surfels.Terms, surfels.ExchangeScale, surfels.GatherScale, surfels.FeedbackScale);
    for (const bool doubling : surfels.Doublings()) std::printf("doubling %d\n", int(doubling));
    for (const std::string& name : surfels.Names) std::printf("object %d\n", surfels.Index(name));
    const std::vector<float> radiances{0.0f, 0.0f, 0.0f, 0.5f, 2.0f, 1.0f}, painted{0.0f, 0.0f, 0.0f, 0.0f, 0.5f, 2.0f, 1.0f, 1.0f};  // of the second of two objects
    for (const float value : surfels.Emitted(radiances, true)) std::printf("emitted %.9g\n", value);
    for (const float value : surfels.Emitted(radiances, false)) std::printf("first %.9g\n", value);
    for (const float value : surfels.Repainted(painted)) std::printf("painted %.9g\n", value);
    print("place", surfels.Place(x, y, z));
    print("direction", surfels.Direction(x, y, z));
    print("back", surfels.UnrealDirection(surfels.Direction(x, y, z)));
    print("middle", surfels.UnrealMiddle());
    for (int face = 0; face < 6; ++face)
        for (const SrbfSurfels::Triple& axis : SrbfSurfels::Face(face)) print("face", axis);
    for (const SrbfSurfels::Triple& axis : SrbfSurfels::Frame({0.48, -0.6, 0.64})) print("frame", axis);
    const std::array<int, 2> square = SrbfSurfels::Square(90);
    std::printf("square %d %d\nversine %.17g\n", square[0], square[1], SrbfSurfels::Versine(0.3));
    return 0;
}
