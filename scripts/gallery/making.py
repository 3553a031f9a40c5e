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
from scripts.gallery import clip, drawing, point_lights, strip
from scripts.gallery.paths import ScenePaths
from scripts.gallery.scenes import Fit, Lantern
from scripts.gallery.steps import Steps
from srbf.asset import Asset
from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings
from srbf.capture import COVERED, Capture
from srbf.demo import build_scene, photographs, scene_script
from srbf.errors import OutputExistsError
from srbf.evaluation.errors_by_role import evaluate
from srbf.evaluation.rate_distortion import Score, compared_methods, contest
from srbf.evaluation.temporal_stability import sampled_texels
from srbf.fitting.options import encode, method_for
from srbf.importing.photographs import LightListImport
from srbf.io import files
from srbf.methods.relighting_map import RelightingMap
from srbf.receiver_images import MANIFEST

FITTING = ("methods/*", "solve/*", "basis/*", "encode/*", "fitting/*")
MEASURING = ("evaluation/*", "relighting/*", "visibility/*")
COMPARING = (*FITTING, "evaluation/*")
PTM = RelightingMap(k=6, basis="ptm")


def make(paths: ScenePaths, steps: Steps, reporter: Reporter) -> None:
    """Run all steps of a scene that are not done yet."""
    scene = paths.scene

    def step(name: str, made_from: Any, outputs: list[Path], work: Callable[[], object]) -> str:
        return steps.run(f"{scene.name}/{name}", made_from, outputs, work)

    script = hashlib.sha256(scene_script(scene.name).read_bytes()).hexdigest()
    built = step("build", script, [paths.blend], lambda: build_scene(scene.name, paths.blend))
    baked = _bake(paths, steps, reporter, built)
    scored = []
    for fit in scene.fits:
        source: list[Any] = [baked, library(FITTING), fit.method, fit.settings, fit.light]
        fitted = step(f"fit {fit.folder}", source, [paths.asset(fit)], partial(_fit, paths, fit, reporter.say))
        scored.append(step(f"evaluate {fit.folder}", [fitted, library(MEASURING)], [paths.errors(fit)], partial(_evaluate, paths, fit)))
    source = [baked, library(COMPARING), scene.contest_texels]
    step("compare methods", source, [paths.scores], partial(_compare, paths))
    source = [scored, _source(strip, drawing), scene.tested, [asdict(fit) for fit in scene.fits]]
    step("strip", source, [paths.strip], lambda: strip.draw(paths))
    source = [scored, _source(clip, drawing), asdict(scene)["clip"], scene.moving, scene.frames, scene.clip_width]
    step("clip", source, [paths.clip], lambda: clip.draw(paths))
    _point_lights(paths, steps, reporter, built, scored)


def is_done(paths: ScenePaths, steps: Steps) -> bool:
    """Whether everything that the page shows of a scene exists."""
    scene = paths.scene
    shown = [paths.strip, paths.clip, paths.scores, *map(paths.errors, scene.fits)]
    return steps.has(f"{scene.name}/clip") and all(path.exists() for path in shown)


def _bake(paths: ScenePaths, steps: Steps, reporter: Reporter, built: str) -> str:
    """Make the capture, through photographs if the scene has a dome; returns its digest."""
    scene, settings = paths.scene, paths.scene.bake_settings()
    if scene.dome is not None:
        listed = paths.folder / photographs.POINT_LIGHTS
        files.make_folder(paths.folder)
        photographs.write_point_lights(listed, scene.dome)
        settings = replace(settings, light_list=listed)
    rendered = paths.rendered
    source = [built, srbf.__version__, settings.record()]
    baked = steps.run(f"{scene.name}/bake", source, [rendered / MANIFEST], partial(_render, rendered, paths.blend, settings, reporter))
    if scene.dome is None:
        return baked
    taken = partial(photographs.photograph, paths.rendered, scene.dome, paths.photographs)
    lists = [paths.photographs / name for name in (photographs.DIRS, photographs.TEST)]
    taken_from = steps.run(f"{scene.name}/photograph", [baked, _source(photographs)], lists, lambda: taken())
    importing = LightListImport(lists[0], "srgb", lists[1])
    known = [paths.capture / MANIFEST]
    return steps.run(f"{scene.name}/import", [taken_from, srbf.__version__], known, lambda: importing.write(paths.capture, force=True))


def _render(folder: Path, blend: Path, settings: BakeSettings, reporter: Reporter) -> None:
    """Bake or resume; replaces a capture of another scene or of other settings."""
    bake = Bake(blend, folder, settings)
    try:
        bake.run(reporter)
    except OutputExistsError:
        bake.run(reporter, force=True)


def _fit(paths: ScenePaths, fit: Fit, say: Callable[[str], None]) -> None:
    settings = {"domain": "auto", "spread": "auto", "ridge": "auto", **fit.settings}
    capture = paths.responses(fit)
    asset = encode(method_for(capture, fit.method, settings, say), capture)
    asset.save(paths.asset(fit), force=True)


def _evaluate(paths: ScenePaths, fit: Fit) -> None:
    """Write the error on held-out lights, as computed by `srbf evaluate`."""
    errors = evaluate(Asset.open(paths.asset(fit)), Capture.open(paths.capture), direct=fit.direct, roles=("holdout",))
    files.write_json(paths.errors(fit), errors)


def _compare(paths: ScenePaths) -> None:
    """Write the scores of methods on a sample of texels under combined light, with the peak of the first fit's evaluation."""
    capture = Capture.open(paths.capture).combined()
    sample = capture.load(sampled_texels(capture.coverage() >= COVERED, paths.scene.contest_texels))
    peak = files.read_json(paths.errors(paths.scene.fits[0]))["holdout"]["peak"]
    methods = [*compared_methods(), PTM] if paths.scene.dome else list(compared_methods())
    files.write_json(paths.scores, {"scores": [asdict(score) for score in contest(sample, methods, "holdout", peak)]})


def read_scores(paths: ScenePaths) -> list[Score]:
    """The scores that `compare methods` wrote."""
    return [Score(**score) for score in files.read_json(paths.scores)["scores"]]


def _point_lights(paths: ScenePaths, steps: Steps, reporter: Reporter, built: str, scored: list[str]) -> None:
    """For a scene with a lantern: bake true Cycles point lights on its path, measure the relit ones against them, and draw both."""
    scene, settings = paths.scene, paths.scene.point_light_settings()
    if settings is None or not isinstance(scene.clip, Lantern):
        return
    known = [paths.true_point_lights / MANIFEST]
    source = [built, srbf.__version__, settings.record()]
    work = partial(_render, paths.true_point_lights, paths.blend, settings, reporter)
    baked = steps.run(f"{scene.name}/bake true point lights", source, known, work)
    split = scene.moved[0]
    errors = [paths.point_light_errors(split)]
    measured = steps.run(
        f"{scene.name}/evaluate true point lights",
        [baked, scored, split.folder, library(MEASURING), _source(point_lights)],
        errors,
        lambda: point_lights.evaluate_point_lights(paths, split),
    )
    source = [measured, _source(point_lights, strip, drawing)]
    steps.run(f"{scene.name}/point light strip", source, [paths.point_light_strip], lambda: point_lights.draw(paths, split))


def library(patterns: Sequence[str]) -> str:
    """A checksum of library modules; a step runs again when it changes. Raises ValueError for a pattern that matches no module."""
    root = Path(srbf.__file__).parent
    matched = {pattern: list(root.glob(f"{pattern}.py")) for pattern in patterns}
    if missing := [pattern for pattern, paths in matched.items() if not paths]:
        raise ValueError(f"expected patterns of modules of srbf, found none for {missing}")
    found = sorted({path for paths in matched.values() for path in paths})
    return hashlib.sha256("".join(map(files.sha256_of, found)).encode()).hexdigest()


def _source(*modules: ModuleType) -> list[str]:
    """Checksums of the source of modules; their drawings are redrawn when it changes."""
    return [files.sha256_of(Path(str(module.__file__))) for module in modules]
