"""srbf: render a scene once under many lights, compress what it answers, relight it in real time."""

__version__ = "0.1.0"
