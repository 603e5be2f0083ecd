"""What was solved: the values of the scenes, side by side."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from validation.scenes.scene import Scene
from validation.scenes.tables import TorqueTable
from validation.validate.tables import Row

KEY_AND_UNIT = "key / unit"  # a column: no file, hence no scene, has a slash in its name
READ_EASILY = 7  # characters of a number; 1000000000 is 1e+9


def scene_rows(scenes: Mapping[str, Scene]) -> list[Row]:
    """A row for each key that one of the scenes has, but for the solvers' settings: the key with
    its unit, and its value in each.
    """
    described, rows = Scene.model_json_schema()["$defs"], list[Row]()
    for table in (name for name in Scene.model_fields if name != "solver"):
        given = {scene: getattr(tables, table) for scene, tables in scenes.items()}
        (kind,) = {type(one) for one in given.values()}
        for key, entry in described[kind.__name__]["properties"].items():
            texts = {scene: _text(getattr(one, key)) for scene, one in given.items()}
            if any(text is not None for text in texts.values()):
                unit = f" ({entry['unit']})" if "unit" in entry else ""
                rows.append({KEY_AND_UNIT: f"{table}.{key}{unit}", **texts})
    return rows


def _text(value: Any) -> str | None:
    """A scene's value in a cell, numbers to ten digits; None: left out."""
    match value:
        case bool():
            return str(value).lower()
        case float():
            plain = f"{value:.10g}"
            short = np.format_float_scientific(value, 9, trim="-", exp_digits=1)
            return plain if len(plain) <= READ_EASILY else min(plain, short, key=len)
        case tuple():
            return ", ".join(str(_text(part)) for part in value)
        case TorqueTable():
            return f"a table of {len(value.time)} times"
    return None if value is None else str(value)
