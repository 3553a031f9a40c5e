// SPDX-License-Identifier: MIT
// A small JSON reader, since JsonUtility reads no nested arrays and asset.json has them. Objects become dictionaries, numbers doubles.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.Text;

namespace Srbf
{
    public sealed class SrbfJson
    {
        readonly string text;
        int at;

        SrbfJson(string text) { this.text = text; }

        /// <summary>Dictionary, List, string, double, bool or null. FormatException where the text is not JSON.</summary>
        public static object Parse(string text)
        {
            var reader = new SrbfJson(text);
            object value = reader.Value();
            reader.Space();
            if (reader.at != text.Length) throw reader.Wrong("the end");
            return value;
        }

        object Value()
        {
            Space();
            if (at >= text.Length) throw Wrong("a value");
            switch (text[at])
            {
                case '{': return Object();
                case '[': return List();
                case '"': return String();
                case 't': return Word("true", true);
                case 'f': return Word("false", false);
                case 'n': return Word("null", null);
                default: return Number();
            }
        }

        Dictionary<string, object> Object()
        {
            var members = new Dictionary<string, object>();
            at++;
            if (Ends('}')) return members;
            do
            {
                Space();
                string name = String();
                Space();
                if (at >= text.Length || text[at++] != ':') throw Wrong("':'");
                members[name] = Value();
            } while (!Closes('}'));
            return members;
        }

        List<object> List()
        {
            var items = new List<object>();
            at++;
            if (Ends(']')) return items;
            do items.Add(Value()); while (!Closes(']'));
            return items;
        }

        string String()
        {
            if (at >= text.Length || text[at] != '"') throw Wrong("a string");
            var found = new StringBuilder();
            for (at++; at < text.Length && text[at] != '"'; at++)
            {
                if (text[at] != '\\') { found.Append(text[at]); continue; }
                if (++at >= text.Length) break;
                int escaped = "bfnrt".IndexOf(text[at]);
                if (text[at] == 'u')
                {
                    if (at + 4 >= text.Length) throw Wrong("four digits");
                    found.Append((char)Convert.ToInt32(text.Substring(at + 1, 4), 16));
                    at += 4;
                }
                else found.Append(escaped >= 0 ? "\b\f\n\r\t"[escaped] : text[at]);
            }
            if (at >= text.Length) throw Wrong("'\"'");
            at++;
            return found.ToString();
        }

        object Number()
        {
            int start = at;
            while (at < text.Length && "+-.eE0123456789".IndexOf(text[at]) >= 0) at++;
            double value;
            if (!double.TryParse(text.Substring(start, at - start), NumberStyles.Float, CultureInfo.InvariantCulture, out value)) throw Wrong("a number");
            return value;
        }

        object Word(string word, object value)
        {
            if (string.CompareOrdinal(text, at, word, 0, word.Length) != 0) throw Wrong(word);
            at += word.Length;
            return value;
        }

        bool Ends(char sign)
        {
            Space();
            if (at >= text.Length || text[at] != sign) return false;
            at++;
            return true;
        }

        bool Closes(char sign)
        {
            if (Ends(sign)) return true;
            if (!Ends(',')) throw Wrong("',' or '" + sign + "'");
            return false;
        }

        void Space() { while (at < text.Length && char.IsWhiteSpace(text[at])) at++; }

        FormatException Wrong(string wanted)
        {
            string found = at < text.Length ? text.Substring(at, Math.Min(12, text.Length - at)) : "the end";
            return new FormatException("expected " + wanted + " at character " + at + " of the JSON text, found " + found);
        }
    }
}
