"""``pymoo-hdte export``: a model of a mechanism as a file of another tool."""

from __future__ import annotations

import argparse
from pathlib import Path

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli.command import Command, Outcome, Say, heading
from pymoo_hdte.cli.own_effects import OPTION, own_effects

TARGETS = ("mujoco", "urdf", "modelica", "python")

_DETAILS = """example:
  pymoo-hdte export my_joint/report/revised_model.toml --to mujoco --out joint.xml

MODEL is the model of a mechanism or joint, such as revised_model.toml of a report. FILE is MJCF,
URDF, Modelica, or Python that needs numpy only. What it leaves out or approximates is printed, and
stands in its first comment. An earlier export is replaced, any other file refused.
Exit codes: 0 exported; 2 the input is at fault."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", type=Path, metavar="MODEL.toml", help="model of a mechanism")
    parser.add_argument("--to", choices=TARGETS, required=True, help="which tool it is for")
    parser.add_argument(
        OPTION, type=Path, metavar="FILE.py", help="Python file with effects of your own; it is run"
    )


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from pymoo_hdte import export
    from pymoo_hdte._io.whole_file import write_whole
    from pymoo_hdte.discrepancy import read_mechanism_model
    from pymoo_hdte.effects import register, registered
    from pymoo_hdte.export.exported import MARK

    _check_file(options.out, MARK)
    with registered():
        for effect in () if options.effects is None else own_effects(options.effects):
            register(effect)
        model = read_mechanism_model(options.model)
        exported = getattr(export, f"to_{options.to}")(model)
    write_whole(options.out, exported.text.encode())
    sentences = [f"{model.title}, for {options.to}: {options.out}"]
    document = heading("export", sentences, exported.notes) | {
        "to": options.to,
        "file": str(options.out),
    }
    return Outcome(document, "\n".join([*sentences, *exported.notes]))


def _check_file(out: Path, mark: str) -> None:
    """Refuse to replace anything but an earlier export."""
    if out.is_symlink() or out.exists():
        allowed = "a file that is new, or an earlier export"
        if out.is_symlink() or not out.is_file():
            raise InvalidInput("--out", str(out), allowed)
        with out.open("rb") as file:
            if mark.encode() not in file.read(4096):
                raise InvalidInput("--out", str(out), allowed)


EXPORT = Command(
    "export",
    "write a model of a mechanism for MuJoCo, URDF, Modelica or Python",
    _DETAILS,
    _add_arguments,
    _run,
    ("FILE", "file to write"),
)
