"""Pairing of the entries of a light list with image files whose names may be spelled differently."""

from __future__ import annotations

import os
import unicodedata
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path, PureWindowsPath

from srbf.captured_light import LightKind
from srbf.errors import ImageError
from srbf.importing.light_list import LightListEntry, read_light_list
from srbf.importing.pictures import RAW_SUFFIXES

ORDINARY = ".bmp .dib .dpx .exr .hdr .jfif .jpe .jpeg .jpg .pbm .pfm .pgm .png .pnm .ppm .rgbe .targa .tga .tif .tiff .webp"
OTHER = ".avif .cin .dds .gif .heic .heif .ico .iff .j2c .j2k .jfi .jif .jp2 .jxl .pic .psb .psd .rgb .rgba .sgi .sxr .tpic .tx .zfile"
RANKS = {
    suffix: rank for rank, suffixes in enumerate((ORDINARY.split(), OTHER.split(), RAW_SUFFIXES)) for suffix in suffixes
}  # the lowest rank wins among equal stems
DIFFERENCES = {
    "case": "another letter case or composition of accents",
    "extension": "another extension",
    "last": "their last part alone, without the folders that the list names",
    "inside": "a folder inside",
    "raw": "stem, where a raw file or one of a rarer format has the same: the picture was taken",
}


def paired(
    light_list: Path, kind: LightKind = "directional", images: Path | None = None, say: Callable[[str], None] = lambda line: None
) -> list[tuple[Path, LightListEntry]]:
    """Pair each entry with its image: by the exact name, else its last part, else its stem, else the same one folder deeper.

    Images must be beside the list or in `images`, even if the list names other folders. If no name is equal, letter case and the
    composition of accents are ignored. Among equal stems, an image wins over a raw file. `say` reports each kind of difference once.
    ImageError if an entry has no image, several, or that of another entry.
    """
    entries = read_light_list(light_list, kind, say)
    if images is not None and not images.is_dir():
        raise ImageError(f"expected a folder of images at {images}, found none; give `images` an existing folder")
    search = _Search(light_list, (light_list.parent,) if images is None else (images, light_list.parent))
    pairs: list[tuple[Path, LightListEntry]] = []
    taken: dict[Path, str] = {}
    for entry in entries:
        path = search.image(entry.name)
        if path in taken:
            raise ImageError(
                f"expected an image of its own for {entry.name!r} in {light_list.name}, found {path.name} taken by {taken[path]!r}"
            )
        taken[path] = entry.name
        pairs.append((path, entry))
    for reason, words in DIFFERENCES.items():
        if reason in search.counts:
            say(f"{search.counts[reason]} of {len(entries)} images of {light_list.name} were found by {words}")
    return pairs


@dataclass(frozen=True)
class _Folder:
    """A folder's files and folders by name and by normalized name, and its images by normalized stem."""

    names: dict[str, Path]
    by_normalized: dict[str, list[Path]]
    stems: dict[str, list[Path]]

    @staticmethod
    def of(path: Path) -> _Folder:
        names = {entry.name: entry for entry in sorted(path.iterdir())}
        by_normalized: dict[str, list[Path]] = {}
        stems: dict[str, list[Path]] = {}
        for name, entry in names.items():
            by_normalized.setdefault(_normalized(name), []).append(entry)
            if entry.suffix.lower() in RANKS and not name.startswith("."):
                stems.setdefault(_normalized(entry.stem), []).append(entry)
        return _Folder(names, by_normalized, stems)


@dataclass
class _Search:
    """Search for a list's images below `roots`; reads each folder once and counts the kinds of difference."""

    light_list: Path
    roots: Sequence[Path]
    counts: Counter[str] = field(default_factory=Counter)
    folders: dict[Path, _Folder] = field(default_factory=dict)

    def image(self, name: str) -> Path:
        """The image for a name of the list."""
        written = PureWindowsPath(name)  # splits at both kinds of slash
        last = written.name
        asked = os.path.normpath(self.light_list.parent.absolute() / written.as_posix())
        for root in self.roots:
            for start in (asked, os.path.normpath(root.absolute() / written.as_posix())):
                below = Path(start)
                top = os.path.normpath(root.absolute())
                if below.is_relative_to(top) and start != top and (path := self._walk(root, below.relative_to(top).parts)) is not None:
                    return path
        for root in self.roots:
            if (path := self._named(root, last)) is not None or (path := self._by_stem([root], last, name)) is not None:
                self.counts["last"] += len(written.parts) > 1
                self.counts += Counter()  # drops zeros
                return path
        inside = [folder for root in self.roots for folder in self._inside(root)]
        found = [path for folder in inside if (path := self._named(folder, last)) is not None]
        if len(set(found)) > 1:
            raise self._several(name, found)
        path = found[0] if found else self._by_stem(inside, last, name)
        if path is None:
            raise self._none(name, last, Path(asked))
        self.counts["inside"] += 1
        return path

    def _walk(self, root: Path, parts: Sequence[str]) -> Path | None:
        """The file at a path below a root, each part by its exact or normalized name; None if a link leads out of all roots."""
        path: Path | None = root
        for part in parts[:-1]:
            path = self._entry(path, part) if path is not None and path.is_dir() else None
        if path is None or not path.is_dir():
            return None
        if len(parts) > 1 and not any(path.resolve().is_relative_to(r.resolve()) for r in self.roots):
            return None
        return self._named(path, parts[-1])

    def _named(self, folder: Path, name: str) -> Path | None:
        path = self._entry(folder, name)
        if path is None or not path.is_file():
            return None
        if path.name != name:
            self.counts["case"] += 1
        return path

    def _entry(self, folder: Path, name: str) -> Path | None:
        """A folder's entry of that name, else the only one that differs in letter case or the composition of accents."""
        content = self._folder(folder)
        if name in content.names:
            return content.names[name]
        matches = content.by_normalized.get(_normalized(name), [])
        composed = [path for path in matches if unicodedata.normalize("NFC", path.name) == unicodedata.normalize("NFC", name)]
        matches = composed or matches
        if len(matches) > 1:
            raise self._several(name, matches)
        return matches[0] if matches else None

    def _by_stem(self, folders: Sequence[Path], last: str, name: str) -> Path | None:
        """The only image of that stem in the most common format present."""
        for stem in dict.fromkeys((last, Path(last).stem)):
            matches = [path for folder in folders for path in self._folder(folder).stems.get(_normalized(stem), []) if path.is_file()]
            best = min((RANKS[path.suffix.lower()] for path in matches), default=0)
            chosen = [path for path in matches if RANKS[path.suffix.lower()] == best]
            if len(chosen) > 1:
                raise self._several(name, chosen)
            if chosen:
                self.counts["raw" if len(matches) > 1 else "extension"] += 1
                return chosen[0]
        return None

    def _inside(self, root: Path) -> list[Path]:
        """The folders in a root, except hidden ones, captures and assets."""
        folders = [path for name, path in self._folder(root).names.items() if path.is_dir() and not name.startswith(".")]
        folders = [path for path in folders if path.resolve().is_relative_to(root.resolve())]
        return [path for path in folders if not any((path / mark).exists() for mark in ("capture.json", "asset.json"))]

    def _folder(self, path: Path) -> _Folder:
        if path not in self.folders:
            self.folders[path] = _Folder.of(path)
        return self.folders[path]

    def _several(self, name: str, paths: Sequence[Path]) -> ImageError:
        names = ", ".join(str(path.relative_to(root)) for path in paths for root in self.roots if path.is_relative_to(root))
        return ImageError(
            f"expected one image {name!r} of {self.light_list.name}, "
            f"found several with that stem ({names}); write its whole name in the list"
        )

    def _none(self, name: str, last: str, asked: Path) -> ImageError:
        where = " or ".join(str(root) for root in self.roots)
        outside = not any(asked.is_relative_to(os.path.normpath(root.absolute())) for root in self.roots)
        if outside and os.path.isfile(asked):  # noqa: PTH113 - Path.is_file raises where a name is too long
            return ImageError(
                f"expected the image {name!r} of {self.light_list.name} below {where}, found it outside: paths outside the list's folder "
                f"are followed only below `images`; add `images={asked.parent}`"
            )
        elsewhere = "; if it is in another folder, add `images`, that folder" if len(self.roots) == 1 else ""
        near = get_close_matches(last, self._folder(self.roots[0]).names, 1)
        nearest = f" (the nearest name is {near[0]!r})" if near else ""
        return ImageError(f"expected the image {last!r} of {self.light_list.name} in {where}, found none{nearest}{elsewhere}")


def _normalized(name: str) -> str:
    """A name normalized: letter case normalized, accents composed."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())
