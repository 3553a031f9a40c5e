"""JSON Schemas of the manifests, and the check of a manifest against its schema."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from srbf.errors import ManifestError, MissingLibraryError

SchemaName = Literal["capture", "asset", "frames"]
Schema = dict[str, Any]
POINT: Schema = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}


@functools.cache
def load_schema(name: SchemaName, method: str | None = None) -> Schema:
    """The JSON Schema (draft 2020-12) of `name`; of an asset with the keys of a `method`'s fragment (the stem of its files)."""
    schema = _read(f"{name}.schema.json")
    fragment = method
    while fragment is not None:
        own = _read(f"methods/{fragment}.schema.json")
        schema["required"] = [*schema["required"], *own["required"]]
        schema["properties"] = {**schema["properties"], **own["properties"]}
        fragment = own.get("extends")
    return schema


def _read(name: str) -> Schema:
    return json.loads(resources.files(__package__).joinpath(name).read_text(encoding="utf-8"))


@functools.cache
def _validator(name: SchemaName, method: str | None = None) -> Any:
    try:
        import jsonschema
    except ImportError as error:
        raise MissingLibraryError("reading manifests needs jsonschema: pip install jsonschema") from error
    plain = jsonschema.Draft202012Validator

    def items(validator: Any, each: Any, value: Any, schema: Schema) -> Iterator[Any]:
        if each != POINT or not _are_points(value):
            yield from plain.VALIDATORS["items"](validator, each, value, schema)

    return jsonschema.validators.extend(plain, {"items": items})(load_schema(name, method))


def _are_points(value: Any) -> bool:
    """Thousands are looked through in a thousandth of the time that jsonschema takes."""
    return isinstance(value, list) and all(
        type(point) is list and len(point) == 3 and all(type(number) in (int, float) for number in point) for point in value
    )


def check(value: Schema, name: SchemaName, where: str) -> None:
    """ManifestError, in one line, where `value` breaks the schema; `where` names the file."""
    _check(value, name, None, where)


def check_asset(value: Schema, method: str, where: str) -> None:
    """`check` of an asset.json, by the keys of its method, too: `method` is the stem of the method's files."""
    _check(value, "asset", method, where)


def _check(value: Schema, name: SchemaName, method: str | None, where: str) -> None:
    validator = _validator(name, method)
    from jsonschema.exceptions import best_match

    errors = list(validator.iter_errors(value))
    error = best_match([cause for found in errors for cause in _of_kind(found)] or errors)
    if error is not None:
        place = "/".join(str(p) for p in error.absolute_path) or "its top level"
        message = error.message if len(error.message) <= 200 else error.message[:197] + "..."
        raise ManifestError(f"{where} breaks the {name} format at {place}: {message}")


def _of_kind(error: Any) -> list[Any]:
    """The error; where it is that of a `oneOf` whose alternatives differ by `kind`, the errors of the alternative of the value's kind."""
    if error.validator != "oneOf" or not isinstance(error.instance, dict) or "kind" not in error.instance:
        return [error]
    alternatives: dict[Any, list[Any]] = {}
    for cause in error.context:
        alternatives.setdefault(cause.schema_path[0], []).append(cause)
    return next((causes for causes in alternatives.values() if not any(list(cause.path) == ["kind"] for cause in causes)), [])


def check_version(manifest: dict[str, Any], expected: str, path: Path) -> None:
    """ManifestError where a manifest has another format, or a version not known to this srbf."""
    found = manifest.get("format")
    if found != expected:
        raise ManifestError(f"expected format {expected!r} in {path}, found {found!r}")
    if manifest.get("version") != 1:
        raise ManifestError(f"expected version 1 in {path}, found {manifest.get('version')!r}; a newer srbf may read it")
