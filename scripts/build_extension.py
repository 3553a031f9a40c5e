"""Builds the Blender extension as a zip: blender_extension/ with the wheel of the library and those of its dependencies.

Built and validated by Blender's own tool, which the bpy of the project's virtual environment ships; run by `make extension`. numpy comes
with Blender. scikit-learn, which clustered eigen maps alone need, is left out: they ask for it by name.
"""

from __future__ import annotations

import argparse
import importlib.util
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LEFT_OUT = ("numpy", "scikit-learn", "imagecodecs")  # the last: 25 MB for profiles and packed TIFF, which `srbf import` asks for by name
# Wheel tags that the builds of each of Blender's platforms can load.
PLATFORMS = {
    "linux-x64": ["manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"],
    "windows-x64": ["win_amd64"],
    "macos-arm64": ["macosx_14_0_arm64", "macosx_13_0_arm64", "macosx_12_0_arm64", "macosx_11_0_arm64"],
}
# Blender's Python and its range of versions, the last one excluded.
BLENDERS = {"3.11": ("4.2.0", "5.1.0"), "3.13": ("5.1.0", None)}
NUMPY = {"3.11": "numpy==1.26.*", "3.13": "numpy>=2"}  # included in Blender; others must be compatible


def main() -> int:
    """Build one zip per platform; returns 1 if a download or Blender's tool fails."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    here = f"{sys.version_info.major}.{sys.version_info.minor}"
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "dist", help="folder of the zips")
    parser.add_argument("--platform", action="append", choices=PLATFORMS, help="repeats; default: this machine's")
    parser.add_argument("--python", default=here, choices=BLENDERS, help="the Python of the Blender to build for")
    parser.add_argument("--blender-version-min", help="where a Blender has another Python than its own builds, as Debian's 4.3 has 3.13")
    asked = parser.parse_args()
    oldest, newest = BLENDERS[asked.python]
    if asked.blender_version_min:
        oldest = asked.blender_version_min
    asked.output.mkdir(parents=True, exist_ok=True)
    try:
        for platform in asked.platform or [_this_platform()]:
            with tempfile.TemporaryDirectory() as folder:
                path = build(Path(folder), asked.output, platform, asked.python, oldest, newest)
            sys.stdout.write(
                f"{path}: {path.stat().st_size / 1e6:.1f} MB, for Blender {oldest} {f'to below {newest}' if newest else 'and later'}\n"
            )
    except subprocess.CalledProcessError as error:
        sys.stderr.write(f"expected {' '.join(map(str, error.cmd[:4]))} … to succeed, found exit status {error.returncode}; see above\n")
        return 1
    return 0


def build(work: Path, output: Path, platform: str, python: str, oldest: str, newest: str | None) -> Path:
    """Stage the extension in `work`, build it into `output`, validate the zip; its path."""
    staged = work / "srbf"
    shutil.copytree(ROOT / "blender_extension", staged, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "LICENSES" / "GPL-3.0-or-later.txt", staged / "LICENSE")
    wheels = staged / "wheels"
    _pip("wheel", "--no-deps", "--wheel-dir", wheels, ROOT, ROOT / "blender_bake")
    (own,) = wheels.glob("srbf-*.whl")
    tags = [word for tag in PLATFORMS[platform] for word in ("--platform", tag)]
    requirements = [*_requirements(python), NUMPY[python]]
    _pip("download", "--only-binary=:all:", "--python-version", python, *tags, "--dest", wheels, *requirements)
    for wheel in wheels.glob("numpy-*.whl"):
        wheel.unlink()
    manifest = staged / "blender_manifest.toml"
    names = "".join(f'  "./wheels/{wheel.name}",\n' for wheel in sorted(wheels.iterdir()))
    head = [f'version = "{own.name.split("-")[1]}"', f'blender_version_min = "{oldest}"', f'platforms = ["{platform}"]']
    if newest:
        head.append(f'blender_version_max = "{newest}"')
    text = manifest.read_text(encoding="utf-8")
    top, table, rest = text.partition("[permissions]")
    manifest.write_text(top + "\n".join(head) + f"\nwheels = [\n{names}]\n\n" + table + rest, encoding="utf-8")
    version = tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]
    path = output / f"srbf-{version}-{platform}-py{python.replace('.', '')}.zip"
    path.unlink(missing_ok=True)
    _blender_ext("build", "--source-dir", staged, "--output-filepath", path)
    _blender_ext("validate", path)
    return path


def _requirements(python: str) -> list[str]:
    """What pyproject.toml has the library depend on, less what is left out; markers are for the Python of the Blender aimed at."""
    from packaging.requirements import Requirement

    dependencies = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    parsed = [Requirement(text) for text in dependencies]
    wanted = [r for r in parsed if r.name not in LEFT_OUT and (r.marker is None or r.marker.evaluate({"python_version": python}))]
    return [f"{r.name}{r.specifier}" for r in wanted]


def _this_platform() -> str:
    machine = {"linux": "linux-x64", "win32": "windows-x64", "darwin": "macos-arm64"}
    return machine[sys.platform]


def _pip(*arguments: object) -> None:
    subprocess.run([sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *map(str, arguments)], check=True)


def _blender_ext(*arguments: object) -> None:
    """Blender's own command line for extensions, out of the bpy module beside which this runs."""
    spec = importlib.util.find_spec("bpy")
    found = sorted(Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")) if spec and spec.origin else []
    if not found:
        raise SystemExit("expected bpy, which ships Blender's tool for extensions, found none; run make setup")
    subprocess.run([sys.executable, str(found[-1]), *map(str, arguments)], check=True)


if __name__ == "__main__":
    sys.exit(main())
