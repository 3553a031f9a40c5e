// SPDX-License-Identifier: MIT
// A DDS file with the DX10 header as srbf export writes it: an array of layers, each with its mip levels from the full size down.
using System;

namespace Srbf
{
    public sealed class SrbfDds
    {
        public const int Rgba8 = 28, RgbaHalf = 10, Bc1 = 71, Bc7 = 98;  // DXGI's numbers
        const int Header = 148;

        public int Width, Height, Layers, Levels, Format;
        byte[] file;

        /// <summary>The array in a file's bytes; FormatException on another kind of file, or one cut short.</summary>
        public static SrbfDds Read(byte[] file, string path)
        {
            if (file.Length < Header || file[0] != 'D' || file[1] != 'D' || file[2] != 'S' || BitConverter.ToInt32(file, 84) != 0x30315844)
                throw new FormatException("expected a DDS file with a DX10 header at " + path);
            var found = new SrbfDds
            {
                file = file,
                Height = BitConverter.ToInt32(file, 12),
                Width = BitConverter.ToInt32(file, 16),
                Levels = BitConverter.ToInt32(file, 28),
                Format = BitConverter.ToInt32(file, 128),
                Layers = BitConverter.ToInt32(file, 140),
            };
            if (Array.IndexOf(new[] { Rgba8, RgbaHalf, Bc1, Bc7 }, found.Format) < 0)
                throw new FormatException("expected RGBA bytes, halves, BC1 or BC7 in " + path + ", found DXGI format " + found.Format);
            if (file.Length != Header + found.Layers * found.Before(found.Levels))
                throw new FormatException("expected " + (Header + found.Layers * found.Before(found.Levels)) + " bytes in " + path + ", found " + file.Length);
            return found;
        }

        /// <summary>A layer's level in GPU layout, row 0 the image's top.</summary>
        public byte[] Data(int layer, int level)
        {
            var data = new byte[Bytes(level)];
            Array.Copy(file, Header + layer * Before(Levels) + Before(level), data, 0, data.Length);
            return data;
        }

        int Bytes(int level)
        {
            int width = Math.Max(1, Width >> level), height = Math.Max(1, Height >> level);
            if (Format == Rgba8 || Format == RgbaHalf) return width * height * (Format == Rgba8 ? 4 : 8);
            return (width + 3) / 4 * ((height + 3) / 4) * (Format == Bc1 ? 8 : 16);
        }

        int Before(int level)
        {
            int bytes = 0;
            for (int i = 0; i < level; i++) bytes += Bytes(i);
            return bytes;
        }
    }
}
