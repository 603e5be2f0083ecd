"""What an error or a caution tells the user to set exists: a scene's keys, commands' options."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import cyclopts

from validation.cli import app
from validation.curve_files.contract import Sidecar
from validation.scenes.messages import known_keys

ROOT = Path(__file__).parent.parent
PACKAGES = ("hcm", "meshes", "reference_fem", "validation")
KEY = re.compile(r"\b(?:finger|material|surface|tip|drive|solver)(?:\.[a-z_]+)+")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
WORD = re.compile(r"\b[a-z]+(?:_[a-z]+)+\b|\b[a-z]+(?= ?= ?')")  # step_factor, contact = 'impulse'

# Names that messages of a package's own functions give their parameters, which no scene reaches.
PARAMETERS = {
    "frame_times",  # of hcm
    "wave_speed_m_per_s",  # of meshes
    "max_elements",
    "max_updates",
    "thickness_at_points",  # of reference_fem
    "n_nodes",
    "n_cells",
    "hertz_force",
    "add_force",
    "contact_forces",
    "least_det",
    "flight_mesh",
}
# Of the files that a message names, sidecars, curves and plans of sweeps, not of settings.
CONTENTS = {"phalanx_w", "time_s", "kind", *Sidecar.model_fields}
FOREIGN = {"--nthreads"}  # an option of another program's
FILES = {"material.dat"}  # of a peer program


def sentences(file: Path) -> Iterator[tuple[str, bool]]:
    """Every text of a file but for docstrings, and whether it is part of a refusal or advice."""
    tree = ast.parse(file.read_text("utf-8"))
    docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    said = {
        id(part)
        for node in ast.walk(tree)
        if isinstance(node, ast.Raise | ast.Dict)
        or (isinstance(node, ast.keyword) and node.arg == "advice")
        or (isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "append")
        for part in ast.walk(node)
    }
    for node in ast.walk(tree):
        is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
        if is_text and id(node) not in docstrings:
            yield node.value, id(node) in said


def options(commands: cyclopts.App) -> Iterator[str]:
    """Names of all options of all commands."""
    for name in commands:
        if name.startswith("-"):
            yield name
            continue
        command = commands[name]
        yield from options(command)
        if command.default_command is not None:
            for argument in command.assemble_argument_collection():
                yield from argument.names


def test_every_key_and_option_that_is_named_exists() -> None:
    keys = set(known_keys())
    tables = {key.rsplit(".", n)[0] for key in keys for n in (1, 2)}
    words = {key.rsplit(".", 1)[-1] for key in keys} | PARAMETERS | CONTENTS
    known_options = set(options(app))
    assert "--set" in known_options
    unknown = []
    for file in sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        for text, said in sentences(file):
            wrong = {key for key in KEY.findall(text) if key not in keys | tables | FILES}
            # of a text that goes on with a name, such as solver.hcm.flight_{kind}
            wrong -= {key for key in wrong if key.endswith("_") and text.endswith(key)}
            wrong |= {
                option for option in OPTION.findall(text) if option not in known_options | FOREIGN
            }
            if said and " " in text:
                wrong |= {word for word in WORD.findall(text) if word not in words}
            unknown += [f"{file.relative_to(ROOT)}: {name} in {text!r}" for name in wrong]
    assert not unknown, "\n".join(unknown)
