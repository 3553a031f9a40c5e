"""Every failure that a user can cause or mend: one root, one line of text (expected, found, what to do)."""


class SrbfError(Exception):
    """Root of all errors raised on purpose; its text is one line fit to print as it stands."""


class InputError(SrbfError, ValueError):
    """A value, a flag or an argument that cannot be used."""


class ManifestError(SrbfError, ValueError):
    """A capture.json, asset.json or lights file that breaks its format."""


class ImageError(SrbfError, OSError):
    """An image that cannot be read or written, or that holds what it must not (NaN, another size)."""


class OutputExistsError(SrbfError, FileExistsError):
    """An output that exists and may be neither resumed nor overwritten."""


class MissingLibraryError(SrbfError, ImportError):
    """An optional library that this step needs and that is not installed."""


class BakeError(SrbfError, RuntimeError):
    """Blender could not bake: the scene, the receiver, or the worker process itself."""


class ShaderError(SrbfError, RuntimeError):
    """A shader that cannot be assembled, compiled or run, or no OpenGL to run it on."""
