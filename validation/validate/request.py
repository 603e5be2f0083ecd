"""The plan that the arguments of ``fingertap validate`` ask for."""

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from validation.curve_files.contract import read_sidecar
from validation.curve_files.read import Reference, is_curve_file, read_reference
from validation.errors import UserError, model_failure
from validation.harness.quantities import COMPARED
from validation.models import adapter, model_names
from validation.scenes.load import NamedScene, load_scene
from validation.scenes.messages import show
from validation.validate.plan import PAPER, Plan

TOLERANCE_NAMES = {
    "peak": "peak_normal_force_N",
    "impulse": "normal_impulse_N_s",
    "duration": "contact_duration_s",
    "arrival": "contact_time_s",
    "tangential": "peak_tangential_force_N",
    "stress": "peak_stress_R_Pa",
}
KEYS = tuple(entry.key for entry in COMPARED)


def plan_of(scenes: Sequence[str], models: str, reference: str, tolerance: str) -> Plan:
    """The plan that the command line asks for.

    Raises UserError: a scene is refused or two have one name, a model is unknown, named twice, or
        refuses one of the scenes, a tolerance or a file of curves can't be read, or a scene has no
        such file.
    Raises RunFailedError: a model fails where it should refuse or take a scene.
    """
    named = {}
    for source in scenes or PAPER.scenes.values():
        scene = load_scene(source)
        if scene.name in named:
            raise UserError(
                f"scene {source}: another scene is called {scene.name} as well; rename the file"
            )
        named[scene.name] = scene
    wanted = [name.strip() for name in models.split(",")]
    if not all(wanted):
        raise UserError(f"--models {show(models)}: a name is missing; write hcm, or hcm,fem2d")
    if len(set(wanted)) < len(wanted) or reference in wanted:
        raise UserError(f"--models {models}: a model is named twice, or is the reference as well")
    files = [reference] if os.path.isfile(reference) else reference.split(",")
    files = [] if reference in model_names() else [part.strip() for part in files]
    if len(files) > 1 and not all(files):
        raise UserError(f"--reference {reference}: a name between commas is missing")
    data = _data(files, named) if any(map(is_curve_file, files)) else {}
    if files and not data and os.path.isdir(reference):
        raise UserError(f"--reference {reference}: is a folder; give a file of curves or a model")
    asked = [("--models", name) for name in wanted] + [("--reference", reference)] * (not data)
    for option, name in asked:
        model = adapter(name, option)
        for scene in named.values():
            try:
                refused = model.refusal(scene)
            except UserError:
                raise
            except (Exception, SystemExit) as error:  # another package's
                raise model_failure(scene.name, name, error) from error
            if refused:
                raise UserError(f"scene {scene.name}, model {name}: {refused}")
    sources = dict(zip(named, scenes or PAPER.scenes.values(), strict=True))
    return Plan(sources, tuple(wanted), reference, data, read_tolerances(tolerance))


def _data(files: Sequence[str], scenes: Mapping[str, NamedScene]) -> Mapping[str, Reference]:
    """The curves of each scene: the scene is the one a file's sidecar names, or the only one."""
    data: dict[str, Reference] = {}
    for file in files:
        name = read_sidecar(Path(file)).scene or (next(iter(scenes)) if len(scenes) == 1 else "")
        if name not in scenes or name in data:
            raise UserError(
                f"--reference {file}: whose curves? State in {file}.toml scene = one of "
                f"{', '.join(scenes)}, each once (it is {name!r})"
            )
        data[name] = read_reference(file, scenes[name])
    if missing := scenes.keys() - data.keys():
        raise UserError(
            f"--reference {','.join(files)}: no curves for the scene {min(missing)}; give a file "
            "for each scene, with commas between them, or fewer scenes"
        )
    return data


def read_tolerances(text: str) -> Mapping[str, float]:
    """Tolerances in percent by the quantity's key, from a text like ``peak=5,impulse=3``.

    Raises UserError: a name is unknown or given twice, or its value is not a positive number.
    """
    found = {}
    for part in (part.strip() for part in text.split(",") if text):
        name, equals, number = (piece.strip() for piece in part.partition("="))
        if not equals:
            raise UserError(f"--tolerance {show(text)}: must be NAME=PERCENT, as in peak=5")
        key = TOLERANCE_NAMES.get(name, name)
        if key not in KEYS:
            known = ", ".join((*TOLERANCE_NAMES, *KEYS))
            raise UserError(f"--tolerance {show(part)}: unknown quantity; known are {known}")
        if key in found:
            raise UserError(f"--tolerance {show(text)}: {key} appears twice; leave one out")
        try:
            percent = float(number)
        except ValueError:
            percent = math.nan
        if not 0.0 < percent < math.inf:
            raise UserError(f"--tolerance {show(part)}: must be NAME=PERCENT, as in peak=5")
        found[key] = percent
    return found
