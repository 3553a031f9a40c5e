"""Errors that a user can cause or fix: one root class, one line of text (expected, found, what to do)."""


class SrbfError(Exception):
    """Root of all errors raised on purpose; its text is one printable line."""


class InputError(SrbfError, ValueError):
    """A value, a flag or an argument that cannot be used."""


class ManifestError(SrbfError, ValueError):
    """A capture.json, asset.json or lights file that violates its format."""


class ImageError(SrbfError, OSError):
    """An image that cannot be read or written, or that has invalid content (NaN, another size)."""


class OutputExistsError(SrbfError, FileExistsError):
    """An output that exists and can be neither resumed nor overwritten."""


class MissingLibraryError(SrbfError, ImportError):
    """A missing optional library that this step needs."""


class BakeError(SrbfError, RuntimeError):
    """Blender could not bake: the scene, the receiver, or the worker process itself."""


class ShaderError(SrbfError, RuntimeError):
    """A shader that cannot be assembled, compiled or run, or no OpenGL to run it on."""
