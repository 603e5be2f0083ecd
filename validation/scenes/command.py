"""``fingertap schema`` and ``fingertap new``: what a scene may hold, and a scene to start from."""

import json
import shlex
from pathlib import Path

from validation.errors import UserError, reason
from validation.harness.console import output
from validation.harness.files import write_text
from validation.scenes.load import read_document, validate
from validation.scenes.messages import show


def print_schema() -> None:
    """Print the JSON Schema of a scene: keys, units, bounds, defaults.

    Editors complete and check TOML by it (Even Better TOML, Taplo): write it to a file, and name
    that in the scene's first line, ``#:schema scene.schema.json``.
    """
    from validation.scenes.schema import scene_schema

    output(json.dumps(scene_schema(), indent=2))


def new_scene(path: Path, /, *, like: str = "soft") -> None:
    """Write a commented scene.

    Parameters
    ----------
    path
        File to write, NAME.toml; an existing file is not overwritten.
    like
        The scene whose values it takes: a built-in one or a TOML file.
    """
    from validation.scenes.schema import scene_text

    if path.suffix != ".toml":
        raise UserError(f"{show(str(path))}: a scene's name ends in .toml; give NAME.toml")
    _, values = read_document(like)
    validate(values, like)
    text = scene_text(values)
    try:
        with path.open("x", encoding="utf-8"):
            pass
    except FileExistsError as error:
        raise UserError(f"{path}: already exists; give another name or remove it") from error
    except (OSError, ValueError) as error:
        raise UserError(
            f"{show(str(path))}: cannot be written ({reason(error)}); check the path"
        ) from error
    write_text(path, text)
    model = "hcm" if "normal_stiffness" in values.get("tip", {}) else "hcm-refined"
    run = f"fingertap run {shlex.quote(str(path))} --model {model}"
    output(f"{path}: a scene like {like}; run it: {run}")
