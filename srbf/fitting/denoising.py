"""Whether a capture's train images are filtered before a fit: where that lowers the error at the validation lights, by more than chance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.capture import COVERED, Capture
from srbf.encode.denoised_capture import denoised
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.methods.protocol import Method

Denoise = Literal["auto", "on", "off"]

TRIED_TEXELS = 1 << 13
FEWEST_LIGHTS = 4  # validation lights whose gains tell how far they scatter
CERTAINTY = 2.0  # standard errors of the mean gain, which it must exceed
WORTH = 0.05  # dB, the least gain besides


def filtered(
    method: Method, capture: Capture, denoise: Denoise = "auto", say: Callable[[str], None] = lambda line: None, by_blocks: bool = False
) -> Capture:
    """The capture that a method is to fit: with less noise (see `srbf.encode.denoised_capture`) where `denoise` says so, else itself.

    `auto`: two fits to a sample of the texels are compared on the validation lights. The filter is kept if their pooled PSNR rises by
    WORTH, and their mean one by that and by CERTAINTY standard errors. Of a method that takes minutes, it is not. Lightmaps under
    directional lights and of patches have it. InputError on `on` for others, and with `by_blocks` of rows, fitted without their neighbors.
    """
    if denoise not in get_args(Denoise):
        raise InputError(f"expected `denoise` auto, on or off, found {denoise!r}")
    if denoise == "off":
        return capture
    lacking = _lacking(capture, by_blocks)
    if lacking is not None and denoise == "on":
        raise InputError(f"expected a lightmap under directional lights or of patches with `denoise=on`, found {lacking}; leave it out")
    if lacking is not None or (denoise == "auto" and not (method.quick and len(capture.indices("validation")) >= FEWEST_LIGHTS)):
        return capture
    clean = denoised(capture)
    if clean is None:
        if denoise == "on":
            raise InputError(f"expected positions and normals of a lightmap's texels for `denoise=on`, found none in {capture.folder}")
        return capture
    if denoise == "on":
        return clean
    before, after = _errors(method, capture, clean)
    gains = 20 * np.log10(np.maximum(before, 1e-30) / np.maximum(after, 1e-30))
    least = max(WORTH, CERTAINTY * float(gains.std(ddof=1)) / np.sqrt(len(gains)))
    pooled = 20 * float(np.log10(np.linalg.norm(before) / max(float(np.linalg.norm(after)), 1e-30)))
    kept = float(gains.mean()) > least and pooled > WORTH
    verb = "gain" if kept else "would change by"
    say(f"{'denoised' if kept else 'not denoised'}: validation lights of a sample {verb} {gains.mean():.2f} dB, {pooled:.2f} dB pooled")
    return clean if kept else capture


def _lacking(capture: Capture, by_blocks: bool) -> str | None:
    """What is there in place of a lightmap's images that neighbors may be averaged of."""
    receivers = [entry for entry in (capture.manifest.get("receiver"), *capture.manifest.get("receivers", [])) if entry is not None]
    kinds = {entry["kind"] for entry in receivers}
    if by_blocks:
        return "`dask`, which fits rows without their neighbors"
    if capture.is_cubemap:
        return "a capture by rays"
    if capture.kind not in ("directional", "patch"):
        return f"{capture.kind} lights"
    return None if kinds == {"lightmap"} else " and ".join(sorted(kinds)) or "images without a receiver"


def _errors(method: Method, capture: Capture, clean: Capture) -> tuple[Float64[ndarray, " V"], Float64[ndarray, " V"]]:
    """RMSE under each validation light of a fit to a sample of the texels, with noise and without."""
    covered = np.flatnonzero(capture.coverage().ravel() >= COVERED)
    texels = covered
    if len(covered) > TRIED_TEXELS:
        texels = np.sort(np.random.default_rng(0).choice(covered, TRIED_TEXELS, replace=False))
    tried = method.on_sample(len(covered) / len(texels))
    roles = [None if light.role == "holdout" else light.role for light in capture.lights]
    noisy, quiet = (one.with_roles(roles).load(texels) for one in (capture, clean))
    found = []
    for trial in (noisy, quiet):
        errors = evaluate(tried.encode(trial), noisy, roles=("validation",))
        found.append(np.array([light["rmse"] for light in errors["lights"]]))
    return found[0], found[1]
