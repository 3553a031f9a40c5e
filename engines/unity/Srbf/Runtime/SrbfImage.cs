// SPDX-License-Identifier: MIT
// EXR and PNG files as numbers, row 0 at the top, without Unity's texture importer, which would flip, compress and resize them.
using System;
using System.Collections.Generic;
using System.IO;
using System.IO.Compression;
using System.Text;

namespace Srbf
{
    public sealed class SrbfImage
    {
        public int Width, Height, Channels;
        public bool Half;       // all channels were half floats
        public float[] Values;  // rows from the top, Channels per texel: R, RGB or RGBA

        /// <summary>An EXR or PNG file, by its extension. FormatException on kinds that the exporter does not write.</summary>
        public static SrbfImage Read(string path)
        {
            byte[] file = File.ReadAllBytes(path);
            return path.EndsWith(".png", StringComparison.OrdinalIgnoreCase) ? Png(file, path) : Exr(file, path);
        }

        /// <summary>Four channels per texel for a GPU texture: missing ones are 0, alpha 1.</summary>
        public float[] Rgba()
        {
            var rgba = new float[Width * Height * 4];
            for (int i = 0; i < Width * Height; i++)
            {
                rgba[4 * i + 3] = 1;
                for (int c = 0; c < Channels; c++) rgba[4 * i + c] = Values[Channels * i + c];
            }
            return rgba;
        }

        static SrbfImage Exr(byte[] file, string path)
        {
            if (file.Length < 8 || BitConverter.ToInt32(file, 0) != 20000630) throw new FormatException("expected an EXR file at " + path);
            if ((BitConverter.ToInt32(file, 4) & 0x1A00) != 0) throw new FormatException("expected one part of scan lines in " + path);
            var names = new List<string>();
            var halves = new List<bool>();
            int at = 8, compression = 0, width = 0, height = 0, top = 0;
            while (file[at] != 0)
            {
                string name = Name(file, ref at), type = Name(file, ref at);
                int size = BitConverter.ToInt32(file, at), start = at + 4;
                at = start + size;
                if (name == "compression") compression = file[start];
                if (name == "dataWindow")
                {
                    top = BitConverter.ToInt32(file, start + 4);
                    width = BitConverter.ToInt32(file, start + 8) - BitConverter.ToInt32(file, start) + 1;
                    height = BitConverter.ToInt32(file, start + 12) - top + 1;
                }
                if (name != "channels" || type != "chlist") continue;
                for (int entry = start; file[entry] != 0; entry += 16)
                {
                    names.Add(Name(file, ref entry));
                    int kind = BitConverter.ToInt32(file, entry);
                    if (kind == 0) throw new FormatException("expected half or float channels in " + path);
                    halves.Add(kind == 1);
                }
            }
            at++;
            if (compression != 0 && compression != 2 && compression != 3) throw new FormatException("expected ZIP or no compression in " + path + ", found kind " + compression);
            int lines = compression == 3 ? 16 : 1, blocks = (height + lines - 1) / lines, count = names.Count;
            var image = new SrbfImage { Width = width, Height = height, Channels = count, Half = halves.TrueForAll(half => half), Values = new float[width * height * count] };
            int lineBytes = 0;
            foreach (bool half in halves) lineBytes += width * (half ? 2 : 4);
            for (int block = 0; block < blocks; block++)
            {
                int start = (int)BitConverter.ToInt64(file, at + 8 * block);
                int first = BitConverter.ToInt32(file, start) - top, size = BitConverter.ToInt32(file, start + 4);
                int rows = Math.Min(lines, height - first), wanted = rows * lineBytes;
                byte[] data = new byte[wanted];
                if (size == wanted) Array.Copy(file, start + 8, data, 0, wanted);
                else data = Unpredicted(Inflated(file, start + 8, size, wanted, path));
                int place = 0;
                for (int row = first; row < first + rows; row++)
                    for (int c = 0; c < count; c++)
                    {
                        int target = Channel(names, c);
                        for (int x = 0; x < width; x++, place += halves[c] ? 2 : 4)
                            image.Values[(row * width + x) * count + target] = halves[c] ? FromHalf(BitConverter.ToUInt16(data, place)) : BitConverter.ToSingle(data, place);
                    }
            }
            return image;
        }

        /// <summary>Index in a texel of a channel of the file; the file's are in alphabetical order.</summary>
        static int Channel(List<string> names, int c)
        {
            int wanted = Array.IndexOf(new[] { "R", "G", "B", "A" }, names[c]);
            return names.Count > 1 && wanted >= 0 && wanted < names.Count ? wanted : c;
        }

        static SrbfImage Png(byte[] file, string path)
        {
            if (file.Length < 33 || file[1] != 'P' || file[2] != 'N' || file[3] != 'G') throw new FormatException("expected a PNG file at " + path);
            int width = BigEndian(file, 16), height = BigEndian(file, 20);
            int channels = Array.IndexOf(new[] { 0, 4, 2, 6 }, (int)file[25]) + 1;
            if (file[24] != 8 || channels == 0 || file[28] != 0) throw new FormatException("expected 8 bits per channel, not interlaced, without a palette in " + path);
            var packed = new MemoryStream();
            for (int at = 8; at + 8 < file.Length; at += 12 + BigEndian(file, at))
                if (Encoding.ASCII.GetString(file, at + 4, 4) == "IDAT") packed.Write(file, at + 8, BigEndian(file, at));
            int stride = width * channels;
            byte[] data = Inflated(packed.ToArray(), 0, (int)packed.Length, (stride + 1) * height, path);
            var image = new SrbfImage { Width = width, Height = height, Channels = channels, Values = new float[stride * height] };
            var above = new byte[stride];
            for (int row = 0; row < height; row++)
            {
                int filter = data[row * (stride + 1)];
                var line = new byte[stride];
                for (int i = 0; i < stride; i++)
                {
                    int left = i < channels ? 0 : line[i - channels], up = above[i], corner = i < channels ? 0 : above[i - channels];
                    int guess = filter == 1 ? left : filter == 2 ? up : filter == 3 ? (left + up) / 2 : filter == 4 ? Paeth(left, up, corner) : 0;
                    line[i] = (byte)(data[row * (stride + 1) + 1 + i] + guess);
                    image.Values[row * stride + i] = line[i];
                }
                above = line;
            }
            return image;
        }

        static int Paeth(int left, int up, int corner)
        {
            int fromLeft = Math.Abs(up - corner), fromUp = Math.Abs(left - corner), fromCorner = Math.Abs(left + up - 2 * corner);
            return fromLeft <= fromUp && fromLeft <= fromCorner ? left : fromUp <= fromCorner ? up : corner;
        }

        static byte[] Inflated(byte[] file, int start, int size, int wanted, string path)
        {
            var data = new byte[wanted];
            using (var stream = new DeflateStream(new MemoryStream(file, start + 2, size - 2), CompressionMode.Decompress))  // 2: zlib's own header
                for (int read = 0; read < wanted;)
                {
                    int more = stream.Read(data, read, wanted - read);
                    if (more == 0) throw new FormatException("expected " + wanted + " bytes of pixels in " + path + ", found " + read);
                    read += more;
                }
            return data;
        }

        /// <summary>Undo what EXR's ZIP does before compression: differences, and two interleaved halves.</summary>
        static byte[] Unpredicted(byte[] data)
        {
            for (int i = 1; i < data.Length; i++) data[i] = (byte)(data[i - 1] + data[i] - 128);
            var found = new byte[data.Length];
            int half = (data.Length + 1) / 2;
            for (int i = 0; i < data.Length; i++) found[i] = data[i % 2 == 0 ? i / 2 : half + i / 2];
            return found;
        }

        static string Name(byte[] file, ref int at)
        {
            int start = at;
            while (file[at] != 0) at++;
            return Encoding.ASCII.GetString(file, start, at++ - start);
        }

        static int BigEndian(byte[] file, int at) { return file[at] << 24 | file[at + 1] << 16 | file[at + 2] << 8 | file[at + 3]; }

        public static float FromHalf(ushort half)
        {
            int exponent = half >> 10 & 31, fraction = half & 1023;
            double size = exponent == 0 ? fraction * Math.Pow(2, -24) : exponent == 31 ? (fraction == 0 ? double.PositiveInfinity : double.NaN) : (1024 + fraction) * Math.Pow(2, exponent - 25);
            return (float)((half & 0x8000) == 0 ? size : -size);
        }

        /// <summary>The nearest half float, ties to even; infinite beyond its range.</summary>
        public static ushort ToHalf(float value)
        {
            int bits = BitConverter.ToInt32(BitConverter.GetBytes(value), 0);
            int sign = bits >> 16 & 0x8000;
            double size = Math.Abs((double)value);
            if (double.IsNaN(size)) return (ushort)(sign | 0x7E00);
            if (size >= 65520) return (ushort)(sign | 0x7C00);
            int exponent = size < Math.Pow(2, -14) ? -14 : (int)Math.Floor(Math.Log(size, 2));
            if (size < Math.Pow(2, exponent)) exponent--;
            if (exponent < -14) exponent = -14;
            int fraction = (int)Math.Round(size * Math.Pow(2, 10 - exponent), MidpointRounding.ToEven);  // 2048: carries into the exponent
            return (ushort)(sign | (fraction < 1024 ? fraction : (exponent + 14 << 10) + fraction));
        }
    }
}
