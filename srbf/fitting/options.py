"""From what a user asks for to a method with its settings: by name, by bytes per texel, or by decibels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.encode.uv_seams import Stitch
from srbf.errors import InputError
from srbf.fitting.auto_method import check_budget, within_budget
from srbf.fitting.denoising import Denoise, filtered
from srbf.light_domain import domain_of_capture
from srbf.methods.protocol import QUIET, FitRun, Method
from srbf.registry import all_methods, method_named, method_names

AUTO = "auto"
BUDGET_SETTINGS = ("budget", "psnr", "error")  # of a choice


def fit(
    capture: Capture,
    method: str | Method | None = None,
    *,
    stitch: bool = True,
    denoise: Denoise = "auto",
    run: FitRun = QUIET,
    say: Callable[[str], None] = lambda line: None,
    **settings: Any,
) -> Asset:
    """The asset of a capture: its train lights compressed by a method.

    Parameters
    ----------
    capture
        What `Capture.open` reads.
    method
        `relighting-map`, `eigen-map`, `clustered-eigen-map`, or one with its settings, such as `RelightingMap(k=25)`. By default what the
        settings imply (`k` relighting maps, `components` an eigen map, `clusters` a clustered one), and without those `auto`: the best
        within `budget` bytes per texel (16), or with the fewest bytes that reach `psnr` dB, or a relative RMSE of `error`, on held-out
        lights of a sample.
    stitch
        Close the seams of the UV layer, where the capture has any.
    denoise
        Filter the noise of few samples out of a lightmap's train images first; `auto`: where a sample's validation lights gain.
    run
        What to report progress to.
    say
        Called with a line on what was chosen.
    **settings
        Of the method.

    Returns
    -------
    Asset
        In memory; `Asset.save` writes it.

    Raises
    ------
    InputError
        On a setting that the method does not have, on values out of range, and on a capture without train lights or with lights that
        the method cannot fit.

    Examples
    --------
    >>> fit(capture, k=9).k
    9
    >>> fit(capture, budget=8).bytes_per_texel()["directional"] <= 8
    True
    """
    if run.say is QUIET.say:
        run = replace(run, say=say)
    if isinstance(method, Method):
        if settings:
            raise InputError(f"expected settings within the method, found {', '.join(settings)} beside {method.name}")
        return encode(method, capture, run, stitch, denoise)
    return encode(method_for(capture, method, settings, say), capture, run, stitch, denoise)


def method_for(
    capture: Capture, method: str | None = None, settings: dict[str, Any] | None = None, say: Callable[[str], None] = lambda line: None
) -> Method:
    """The method with its settings; `auto`, the default, tries what fits into `budget` or reaches `psnr` on a sample of the capture.

    Without a `method` the capture implies it, where it is of glossy surfaces, or the settings: `k` relighting maps, `components` an eigen
    map, `clusters` a clustered one.
    InputError on a setting that the method does not have, on values out of range, and on a capture whose lights it cannot fit.
    """
    settings = {} if settings is None else settings
    if method is None:
        method = next((m.name for m in all_methods() if m.is_made_for(capture) and set(settings) <= set(m.settings())), None)
    name = check_settings(method, settings)
    if name == AUTO:
        return within_budget(capture, say=say, **settings)
    chosen = method_named(name)
    kind = domain_of_capture(capture, settings.get("domain", "auto")).kind
    if kind not in chosen.domains:
        raise InputError(
            f"expected a capture in the light domain {' or '.join(chosen.domains)} for method {name}, found {kind}; "
            "bake with another `light_set`, or fit with another method"
        )
    for receiver in (capture.manifest.get("receiver"), *capture.manifest.get("receivers", [])):
        if receiver is not None and receiver["kind"] not in chosen.receivers:
            raise InputError(f"expected a capture of {' or '.join(chosen.receivers)} for method {name}, found {receiver['kind']}")
    return chosen(**settings)


def check_settings(method: str | None, settings: dict[str, Any]) -> str:
    """The method's name, given or implied. InputError on a setting that it does not have, and on a value out of range."""
    name = implied_method(settings) if method is None else _variant(method, settings)
    if name == AUTO:
        _check_known(AUTO, settings, (*BUDGET_SETTINGS, *_shared_settings()))
        check_budget(settings.get("budget"), settings.get("psnr"), settings.get("error"))
        _check_values(settings)
    else:
        _check_known(name, settings, method_named(name).settings())
        chosen = method_named(name)
        for entry in fields(chosen):  # type: ignore[arg-type]
            value, words = settings.get(entry.name), entry.metadata.get("words", ())
            if words and isinstance(value, str) and value not in words:
                raise InputError(f"expected `{entry.name}` {', '.join(words)} or a number for method {name}, found {value}")
        chosen(**settings)
    return name


def implied_method(settings: dict[str, Any]) -> str:
    """The method that the settings are of, the most special first; `auto` where they name none."""
    if any(name in settings for name in BUDGET_SETTINGS):
        return AUTO
    named = {*settings, *(f"{name}={value}" for name, value in settings.items())}
    return next((m.name for m in reversed(all_methods()) if named & set(m.implied_by)), AUTO)


def _variant(method: str, settings: dict[str, Any]) -> str:
    """Method M with basis B is the method M-B, where there is one."""
    variant = f"{method}-{settings.get('basis')}"
    return variant if variant in method_names() else method


def encode(method: Method, capture: Capture, run: FitRun = QUIET, stitch: bool = True, denoise: Denoise = "auto") -> Asset:
    """The asset of a method, the capture's UV seams closed where it has any and `stitch` says so, its images filtered as `denoise` says.

    InputError on `run.solve_rows` with a method whose rows are not independent, and on a capture that `denoise` cannot be on for.
    """
    if run.solve_rows is not None and not method.rows_are_independent:
        able = " or ".join(other.name for other in all_methods() if other.rows_are_independent)
        raise InputError(f"expected the method {able} to be fitted by blocks of rows, found {method.name}")
    fitted = filtered(method, capture, denoise, run.say, run.solve_rows is not None)
    asset = method.encode(fitted, replace(run, stitch=Stitch.of(capture) if stitch else None))
    if fitted is not capture:
        asset.manifest["source"]["fit"]["denoised"] = True
    asset.probes = capture.probes()
    return asset


def _check_values(settings: dict[str, Any]) -> None:
    """InputError on values that no method takes which has all of these settings."""
    own = {name: value for name, value in settings.items() if name not in BUDGET_SETTINGS}
    refused = []
    for method in all_methods():
        if set(own) <= set(method.settings()):
            try:
                method(**own)
            except InputError as error:
                refused.append(error)
            else:
                return
    if refused:
        raise refused[0]


def _shared_settings() -> set[str]:
    """What `auto` hands on: settings that every candidate of some light domain has."""
    candidates = [m for m in all_methods() if any(True for _ in m.candidates(1 << 10, 1 << 20, 1 << 10))]
    kinds = {kind for m in candidates for kind in m.domains}
    shared = (set.intersection(*(set(m.settings()) for m in candidates if kind in m.domains)) for kind in kinds)
    return set.union(*shared) - {"components", "encoding", "clusters"}


def _check_known(name: str, settings: dict[str, Any], known: Any) -> None:
    for setting in settings:
        if setting not in known:
            owners = [AUTO] * (setting in BUDGET_SETTINGS) + [m.name for m in all_methods() if setting in m.settings()]
            if not owners:
                raise InputError(f"expected settings of {', '.join((*method_names(), AUTO))}, found {setting!r}")
            raise InputError(f"`{setting}` applies only to method {' or '.join(owners)}, found it with method {name}")
