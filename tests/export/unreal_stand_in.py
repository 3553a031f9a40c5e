"""A stand-in for Unreal's Python module."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any


class Recorder:
    """Stands for anything of Unreal's: remembers properties, returns another for every call of its kind."""

    def __init__(self, kind: str, log: list[tuple[Any, ...]]) -> None:
        self.kind, self.log = kind, log
        self.properties: dict[str, Any] = {}

    def set_editor_property(self, name: str, value: Any) -> None:
        self.properties[name] = value

    def get_editor_property(self, name: str) -> Any:
        return self.properties[name]

    def __setattr__(self, name: str, value: Any) -> None:
        self.__dict__[name] = value

    def __getattr__(self, name: str) -> Any:
        def call(*arguments: Any) -> Any:
            self.log.append((f"{self.kind}.{name}", *arguments))
            return Recorder(f"{self.kind}.{name}()", self.log)

        return call


class StandIn(ModuleType):
    """`unreal` as far as the script asks: classes by name are made, libraries and enumerations respond."""

    def __init__(self, project: Path) -> None:
        super().__init__("unreal")
        self.calls: list[tuple[Any, ...]] = []
        self.made: list[Recorder] = []
        self.Paths = Recorder("Paths", self.calls)
        self.Paths.convert_relative_path_to_full = lambda _: str(project)
        self.EditorAssetLibrary = Recorder("EditorAssetLibrary", self.calls)
        self.MaterialEditingLibrary = Recorder("MaterialEditingLibrary", self.calls)
        self.MaterialEditingLibrary.create_material_expression = lambda _, kind, *__: self.make(kind)
        self.AssetToolsHelpers = Recorder("AssetToolsHelpers", self.calls)
        tools = Recorder("AssetTools", self.calls)
        tools.create_asset = lambda name, folder, kind, factory: self.make(f"{kind} {name}")
        self.AssetToolsHelpers.get_asset_tools = lambda: tools
        self.LinearColor = lambda *values: values

    def make(self, kind: Any) -> Recorder:
        self.made.append(Recorder(getattr(kind, "__name__", str(kind)), self.calls))
        return self.made[-1]

    def load_asset(self, path: str) -> Recorder:
        return self.make(path)

    def log(self, text: str) -> None:
        self.calls.append(("log", text))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)

        class Named(type):
            def __getattr__(cls, member: str) -> str:
                if member.startswith("__"):
                    raise AttributeError(member)
                return f"{name}.{member}"

            def __call__(cls, *_: Any) -> Recorder:
                return stand_in.make(name)

            def __str__(cls) -> str:
                return name

        stand_in = self
        return Named(name, (), {})
