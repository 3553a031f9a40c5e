"""The steps of one scene, in order: build, bake, photograph, fit, evaluate, compare methods, draw."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import srbf
from scripts.gallery import clip, drawing, photographs, point_lights, strip
from scripts.gallery.places import Places
from scripts.gallery.scenes import Fit, Lantern
from scripts.gallery.steps import Steps
from srbf.asset import Asset
from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings
from srbf.capture import COVERED, MANIFEST, Capture
from srbf.demo import build_scene, scene_script
from srbf.errors import OutputExistsError
from srbf.evaluation.errors_by_role import evaluate
from srbf.evaluation.rate_distortion import Score, compared_methods, contest
from srbf.evaluation.temporal_stability import sampled_texels
from srbf.fitting.options import encode, method_for
from srbf.importing.photographs import LightListImport
from srbf.io import files
from srbf.methods.relighting_map import RelightingMap

FITTING = (
    "methods/*",
    "solve/*",
    "basis/*",
    "model_selection",
    "light_space",
    "coefficient_maps",
    "fitting",
    "budget",
    "stitch",
    "quantization",
)
MEASURING = ("evaluation", "direct/*")
COMPARING = (*FITTING, "evaluation", "quality", "motion")
PTM = RelightingMap(k=6, basis="ptm")


def make(places: Places, steps: Steps, reporter: Reporter) -> None:
    """All steps of a scene; what is there already is kept."""
    scene = places.scene

    def step(name: str, made_from: Any, outputs: list[Path], work: Callable[[], object]) -> str:
        return steps.run(f"{scene.name}/{name}", made_from, outputs, work)

    script = hashlib.sha256(scene_script(scene.name).read_bytes()).hexdigest()
    built = step("build", script, [places.blend], lambda: build_scene(scene.name, places.blend))
    baked = _bake(places, steps, reporter, built)
    scored = []
    for fit in scene.fits:
        source: list[Any] = [baked, library(FITTING), fit.method, fit.settings, fit.light]
        fitted = step(f"fit {fit.folder}", source, [places.asset(fit)], partial(_fit, places, fit, reporter.say))
        scored.append(step(f"evaluate {fit.folder}", [fitted, library(MEASURING)], [places.errors(fit)], partial(_evaluate, places, fit)))
    source = [baked, library(COMPARING), scene.contest_texels]
    step("compare methods", source, [places.scores], partial(_compare, places))
    source = [scored, _source(strip, drawing), scene.tested, [asdict(fit) for fit in scene.fits]]
    step("strip", source, [places.strip], lambda: strip.draw(places))
    source = [scored, _source(clip, drawing), asdict(scene)["clip"], scene.moving, scene.frames, scene.clip_width]
    step("clip", source, [places.clip], lambda: clip.draw(places))
    _point_lights(places, steps, reporter, built, scored)


def is_done(places: Places, steps: Steps) -> bool:
    """Whether all that the page shows of a scene is there."""
    scene = places.scene
    shown = [places.strip, places.clip, places.scores, *map(places.errors, scene.fits)]
    return steps.has(f"{scene.name}/clip") and all(path.exists() for path in shown)


def _bake(places: Places, steps: Steps, reporter: Reporter, built: str) -> str:
    """The capture, by way of photographs where the scene has a dome; returns its digest."""
    scene, settings = places.scene, places.scene.bake_settings()
    if scene.dome is not None:
        listed = places.folder / photographs.POINT_LIGHTS
        files.make_folder(places.folder)
        photographs.write_point_lights(listed, scene.dome)
        settings = replace(settings, light_list=listed)
    rendered = places.rendered
    source = [built, srbf.__version__, settings.record()]
    baked = steps.run(f"{scene.name}/bake", source, [rendered / MANIFEST], partial(_render, rendered, places.blend, settings, reporter))
    if scene.dome is None:
        return baked
    taken = partial(photographs.photograph, places.rendered, scene.dome, places.photographs)
    lists = [places.photographs / name for name in (photographs.DIRS, photographs.TEST)]
    taken_from = steps.run(f"{scene.name}/photograph", [baked, _source(photographs)], lists, lambda: taken())
    importing = LightListImport(lists[0], "srgb", lists[1])
    known = [places.capture / MANIFEST]
    return steps.run(f"{scene.name}/import", [taken_from, srbf.__version__], known, lambda: importing.write(places.capture, force=True))


def _render(folder: Path, blend: Path, settings: BakeSettings, reporter: Reporter) -> None:
    """Bake, or go on with it; what is of another scene or other settings is replaced."""
    bake = Bake(blend, folder, settings)
    try:
        bake.run(reporter)
    except OutputExistsError:
        bake.run(reporter, force=True)


def _fit(places: Places, fit: Fit, say: Callable[[str], None]) -> None:
    settings = {"domain": "auto", "spread": "auto", "ridge": "auto", **fit.settings}
    capture = places.responses(fit)
    asset = encode(method_for(capture, fit.method, settings, say), capture)
    asset.save(places.asset(fit), force=True)


def _evaluate(places: Places, fit: Fit) -> None:
    """The error on unseen lights, as `srbf evaluate` has it."""
    errors = evaluate(Asset.open(places.asset(fit)), Capture.open(places.capture), direct=fit.direct, roles=("holdout",))
    files.write_json(places.errors(fit), errors)


def _compare(places: Places) -> None:
    """Methods by bytes on a sample of the texels under all light; the peak is that of the first fit's evaluation, which all share."""
    capture = Capture.open(places.capture).combined()
    sample = capture.load(sampled_texels(capture.coverage() >= COVERED, places.scene.contest_texels))
    peak = files.read_json(places.errors(places.scene.fits[0]))["holdout"]["peak"]
    methods = [*compared_methods(), PTM] if places.scene.dome else list(compared_methods())
    files.write_json(places.scores, {"scores": [asdict(score) for score in contest(sample, methods, "holdout", peak)]})


def read_scores(places: Places) -> list[Score]:
    """What `compare methods` found."""
    return [Score(**score) for score in files.read_json(places.scores)["scores"]]


def _point_lights(places: Places, steps: Steps, reporter: Reporter, built: str, scored: list[str]) -> None:
    """Where a lantern is carried: true lamps of Cycles on its path, how far the relit ones are from them, and both side by side."""
    scene, settings = places.scene, places.scene.point_light_settings()
    if settings is None or not isinstance(scene.clip, Lantern):
        return
    known = [places.true_point_lights / MANIFEST]
    source = [built, srbf.__version__, settings.record()]
    work = partial(_render, places.true_point_lights, places.blend, settings, reporter)
    baked = steps.run(f"{scene.name}/bake true lamps", source, known, work)
    split = scene.moved[0]
    errors = [places.point_light_errors(split)]
    measured = steps.run(
        f"{scene.name}/evaluate true lamps",
        [baked, scored, split.folder, library(MEASURING), _source(point_lights)],
        errors,
        lambda: point_lights.evaluate_point_lights(places, split),
    )
    source = [measured, _source(point_lights, strip, drawing)]
    steps.run(f"{scene.name}/lamp strip", source, [places.point_light_strip], lambda: point_lights.draw(places, split))


def library(patterns: Sequence[str]) -> str:
    """A checksum of the library's modules that make something: it is made again when they change."""
    root = Path(srbf.__file__).parent
    found = sorted({path for pattern in patterns for path in root.glob(f"{pattern}.py")})
    return hashlib.sha256("".join(map(files.sha256_of, found)).encode()).hexdigest()


def _source(*modules: ModuleType) -> list[str]:
    """Checksums of modules' texts: what they draw is drawn again when they change."""
    return [files.sha256_of(Path(str(module.__file__))) for module in modules]
