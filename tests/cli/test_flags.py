"""Former flags work for one version and are not shown; the library's messages name flags; help is in panels and words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
import typer
from test_commands import misused, ok, srbf

from srbf.cli import COMMANDS, app
from srbf.cli.flags import FORMER_FLAGS, in_flags, present

TABLE: Any = typer.main.get_command(app).commands
WITH_VALUE = {"--light-box": "0,0,0,1,1,1", "--part": "1/2", "--time": "90s"}
USES = {flag: [name for name in COMMANDS if any(now in p.opts for p in TABLE[name].params)] for flag, now in FORMER_FLAGS.items()}


def test_each_former_flag_is_of_some_command() -> None:
    assert all(USES.values())
    assert set(FORMER_FLAGS.values()).isdisjoint(FORMER_FLAGS)


@pytest.mark.parametrize(("former", "command"), [(flag, name) for flag, commands in USES.items() for name in commands])
def test_a_former_flag_works_and_is_not_shown(former: str, command: str) -> None:
    parameters = {flag: parameter for parameter in TABLE[command].params for flag in parameter.opts}
    parameter = parameters[FORMER_FLAGS[former]]
    value = WITH_VALUE.get(former, "2")
    required = ["a"] if command == "evaluate" else ["a", "-o", "b"]
    forms = [[former]] if parameter.is_flag else [[former, value], [f"{former}={value}"]]
    for form in forms:
        new = [parameter.opts[0] + form[0][len(former) :], *form[1:]]
        now, then = (TABLE[command].make_context(command, [*required, *words]).params[parameter.name] for words in (new, form))
        assert now == then and now not in (None, False, parameter.default)
    shown = ok(command, "--help").split()
    assert FORMER_FLAGS[former] in shown and former not in shown


def test_what_follows_two_dashes_is_no_flag() -> None:
    ctx = TABLE["relight"].make_context("relight", ["-o", "x.exr", "--", "--a0"])
    assert str(ctx.params["asset"]) == "--a0" and ctx.params["reference_distance"] == 1.0
    assert present("--a0=2", {"--force"}) == "--a0=2"  # of a command that never had it
    assert "No such option: --a0" in misused("info", "x", "--a0", "2")


def test_a_former_target_is_accepted() -> None:
    for name in ("png", "uint8"):
        assert TABLE["export"].make_context("export", ["a", "-o", "b", "--target", name]).params["target"] == "png"
    assert "uint8," not in ok("export", "--help").partition("--encoding")[0]


def test_messages_name_flags() -> None:
    def option(name: str, *flags: str) -> SimpleNamespace:
        return SimpleNamespace(name=name, opts=list(flags), param_type_name="option")

    argument = SimpleNamespace(name="asset", opts=["asset"], param_type_name="argument", metavar=None)
    parameters = [
        option("k", "-k"),
        option("direct", "--direct"),
        option("force", "--force"),
        option("mip_levels", "--mip-levels"),
        argument,
    ]
    text = "expected `k` of 1, found `direct='ray'`, `levels=3` and `budget`; give `force=True`, `asset` or run `srbf complete`"
    assert in_flags(text, parameters) == (
        "expected -k of 1, found --direct ray, --mip-levels 3 and --budget; give --force, ASSET or run `srbf complete`"
    )
    assert (
        in_flags("fit with `visibility=pca:50`, `editable` or `k=4`", parameters[1:]) == "fit with --visibility pca:50, --editable or -k 4"
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_help_is_in_words(command: str) -> None:
    """No type of Python stands for a value, and the list of commands has a summary of one line for each."""
    for parameter in TABLE[command].params:
        if parameter.param_type_name == "option" and not parameter.is_flag:
            shown = parameter.get_help_record(typer.Context(TABLE[command]))[0].split(" ")[-1]
            assert parameter.metavar or "|" in shown or shown == "<openjd>", shown
    lines = [line for line in ok("--help").splitlines() if line.split()[:1] == [command]]
    assert len(lines) == 1 and len(lines[0]) <= 80 and TABLE[command].help


def test_a_bakes_help_is_grouped() -> None:
    help_text = ok("bake", "--help")
    panels = [line.rstrip(":") for line in help_text.splitlines() if line.endswith(":") and not line.startswith(" ")]
    assert panels == ["Arguments", "Options", "Scene", "Lights", "Quality", "Farm", "Safety"]
    farm = help_text.partition("\nFarm:")[2].partition("\nSafety:")[0]
    assert "--shard I/N" in farm and "--workers COUNT" in farm and "--size PIXELS" not in farm
    assert srbf("bake", "--help").stderr == ""
