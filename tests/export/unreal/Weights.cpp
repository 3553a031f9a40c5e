// SPDX-License-Identifier: MIT
// Runs SrbfWeights.h on an exported file of tables and prints what it found, for the tests to compare.
//   weights TABLES NUMBER...   named: index and color of each light that is set; a cloud: place, color at 1 m, and half-angles (rad) or -1 -1
#include "SrbfWeights.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

int main(int count, char** arguments)
{
    std::ifstream stream(arguments[1], std::ios::binary);
    const std::vector<char> file((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    SrbfWeights weights;
    const std::string wrong = weights.Read(reinterpret_cast<const uint8_t*>(file.data()), file.size());
    if (!wrong.empty())
    {
        std::printf("refused %s\n", wrong.c_str());
        return 0;
    }
    std::vector<double> n;
    for (int i = 2; i < count; ++i) n.push_back(std::atof(arguments[i]));
    int outside = 0;
    for (size_t i = 0; !weights.Cloud && i + 3 < n.size(); i += 4) weights.Set(int(n[i]), n[i + 1], n[i + 2], n[i + 3]);
    for (size_t i = 0; weights.Cloud && i + 7 < n.size(); i += 8)
    {
        const double share = n[i + 6] < 0 ? 1 : SrbfWeights::FluxShare(n[i + 6], n[i + 7]);
        outside += !weights.Add(n[i], n[i + 1], n[i + 2], n[i + 3] * share, n[i + 4] * share, n[i + 5] * share);
    }
    std::printf("size %d %d\noutside %d\n", weights.Rows, weights.Columns, outside);
    for (const std::string& name : weights.Names) std::printf("name %d %s\n", weights.Index(name), name.c_str());
    std::printf("weights");
    for (const float value : weights.Texels()) std::printf(" %.9g", value);
    std::printf("\n");
    return 0;
}
