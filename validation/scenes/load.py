"""Reading a scene: a built-in name or a TOML file, then overrides, then validation."""

import copy
import difflib
import os
import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from validation.errors import UserError, reason
from validation.scenes.messages import one_line, show
from validation.scenes.scene import Scene

BUILT_IN = ("hard", "soft", "driven-1", "driven-2", "driven-3")
# Numbers as spreadsheets write them, which TOML does not allow.
BARE_POINT = re.compile(r"[+-]?(\.\d+|\d+\.)([eE][+-]?\d+)?")
MAX_BYTES = 1_000_000  # a scene is a page of text: anything longer is something else


@dataclass(frozen=True)
class NamedScene:
    """A validated scene, its name, and the tables as they were read."""

    name: str
    tables: Scene
    document: dict[str, Any]


def scene_name(source: str) -> str:
    """The name of a scene: a built-in one's own, a file's stem.

    A file whose stem is a built-in scene's name keeps its ending: soft.toml beside soft.
    """
    stem = Path(source).stem
    return source if source in BUILT_IN else file_name(f"{stem}.toml" if stem in BUILT_IN else stem)


def file_name(name: str) -> str:
    """A file's name in a form for result files: the name itself may not be valid UTF-8."""
    return name.encode("utf-8", "backslashreplace").decode()


def read_document(source: str) -> tuple[str, dict[str, Any]]:
    """Name and raw tables of a built-in scene or a TOML file."""
    if source in BUILT_IN:
        text = resources.files("validation.scenes").joinpath(f"{source}.toml").read_text("utf-8")
        return source, tomllib.loads(text)
    path = Path(source)
    # `os.path`: a name that is too long or has a null byte is not a file, and not an error
    there = os.path.exists(path)
    if path.suffix != ".toml" and not there:
        near = difflib.get_close_matches(source, BUILT_IN, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise UserError(
            f"scene {show(source)}: unknown; {hint}built-in scenes are {', '.join(BUILT_IN)}, "
            "or give the path of a TOML file"
        )
    if not os.path.isfile(path):
        why, remedy = "No such file or directory", "check the path"
        if there:
            why = "is a folder" if os.path.isdir(path) else "is not a file"
            remedy = "give the path of a TOML file"
        raise UserError(f"scene {show(source)}: cannot be read ({why}); {remedy}")
    return scene_name(source), read_toml(path, f"scene {source}")


def read_toml(path: Path, origin: str) -> dict[str, Any]:
    """The tables of a TOML file; every refusal begins with the origin."""
    try:
        return tomllib.loads(read_text(path, origin, MAX_BYTES))
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{origin}: TOML syntax error: {error}") from error
    except RecursionError as error:
        raise UserError(f"{origin}: its lists or tables are nested too deeply") from error
    except ValueError as error:  # Python's own text names one of its switches
        raise UserError(f"{origin}: a number has thousands of digits; shorten it") from error


def read_text(path: Path, origin: str, largest: int) -> str:
    """A file's text, at most `largest` bytes; every refusal begins with the origin."""
    try:
        if path.stat().st_size > largest:
            raise UserError(f"{origin}: larger than {largest} bytes, another kind of file")
        # Windows' editors put a byte order mark before the text
        return path.read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UserError(f"{origin}: is not UTF-8 text; give a text file") from error
    except (OSError, ValueError) as error:  # a path with a null byte is a ValueError
        raise UserError(f"{origin}: cannot be read ({reason(error)}); check the path") from error


def parse_value(text: str, origin: str) -> Any:
    """The right side of KEY=VALUE as a TOML value, or a number like .5; a bare word is a string.

    Raises UserError: it begins like a list or a table but is not one.
    """
    try:
        parsed = tomllib.loads(f"value = {text}")
        tomllib.loads(f"value = [{text}]")  # a comment, which is not a value, hides the bracket
    except (ValueError, RecursionError) as error:  # TOML's own error is a ValueError
        if text.strip()[:1] in ("[", "{"):
            raise UserError(
                f"{origin} = {show(text)}: is not a TOML list or table: write numbers as 0.5, "
                "texts in quotes, and close all brackets"
            ) from error
        return float(text) if BARE_POINT.fullmatch(text.strip()) else text
    return parsed["value"] if list(parsed) == ["value"] else text


def sets(assignment: str, key: str) -> bool:
    """Whether KEY=VALUE sets a dotted key, directly or in a table."""
    found: Any = override({}, assignment)
    for part in key.split("."):
        if not isinstance(found, dict) or part not in found:
            return False
        found = found[part]
    return True


def override(document: dict[str, Any], assignment: str) -> dict[str, Any]:
    """A copy of the tables with one dotted ``KEY=VALUE`` set."""
    key, equals, text = assignment.partition("=")
    key, text = key.strip(), text.strip()
    if not equals or not text or not all(part.strip() for part in key.split(".")):
        raise UserError(
            f"--set {show(assignment)}: must be KEY=VALUE with a dotted key, "
            "for example surface.friction=0.7"
        )
    result = copy.deepcopy(document)
    *path, last = (part.strip() for part in key.split("."))
    table = result
    for depth, part in enumerate(path):
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            holder = ".".join(path[: depth + 1])
            raise UserError(
                f"--set {show(assignment)}: {holder} is a value, not a table; give it whole"
            )
    table[last] = parse_value(text, f"--set {key}")
    return result


def validate(document: dict[str, Any], origin: str) -> Scene:
    """Return the validated tables, or raise a ``UserError`` of one line."""
    try:
        return Scene.model_validate(document)
    except ValidationError as error:
        raise UserError(f"scene {origin}: {one_line(error)}") from error


def load_scene(source: str, overrides: Iterable[str] = ()) -> NamedScene:
    """Read, override and validate a scene.

    source : built-in name or path of a TOML file.
    overrides : ``KEY=VALUE`` texts, applied in order.

    Raises UserError: one line naming key, value, what is allowed and what to do.
    """
    name, document = read_document(source)
    return changed_scene(name, document, overrides, source)


def changed_scene(
    name: str, document: dict[str, Any], overrides: Iterable[str], origin: str
) -> NamedScene:
    """The scene made from raw tables and overrides; a refusal names the origin."""
    for assignment in overrides:
        document = override(document, assignment)
    return NamedScene(name, validate(document, origin), document)
