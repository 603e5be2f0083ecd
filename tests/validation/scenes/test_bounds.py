"""A scene's bounds hold whatever the model: what one model is given the other is given too."""

import itertools
import math
import re
from collections.abc import Iterator
from typing import Any

import pytest

import hcm
from hcm.model import check_scene
from hcm.workload import check_size
from validation.errors import UserError
from validation.models import solid_inputs
from validation.models.hcm import hcm_scene
from validation.scenes.load import NamedScene, load_scene
from validation.scenes.scene import Scene
from validation.scenes.scene_number import SceneNumber
from validation.scenes.solver_tables import SolverTable

# Choices, without a bound.
OWN = {"drive.reaction", "material.law"}


def extremes() -> Iterator[tuple[str, tuple[float, ...], tuple[float, ...]]]:
    """Every key of the scene's own tables with its outermost allowed values and those beyond."""
    for name, table in Scene.model_fields.items():
        kind = table.annotation
        assert isinstance(kind, type)
        if kind is SolverTable:
            continue
        for key, field in kind.model_fields.items():  # type: ignore[attr-defined]
            if f"{name}.{key}" in OWN:
                continue
            (bound,) = (m for m in field.metadata if isinstance(m, SceneNumber))
            step = (lambda x, to: x + math.copysign(1, to)) if bound.integer else math.nextafter
            closed = [(bound.at_least, -math.inf), (bound.at_most, math.inf)]
            opened = [(bound.above, math.inf), (bound.below, -math.inf)]
            edges = [(edge, to) for edge, to in closed if math.isfinite(edge)]
            gaps = [(edge, to) for edge, to in opened if math.isfinite(edge)]
            number = int if bound.integer else float
            inside = [edge for edge, _ in edges] + [step(edge, to) for edge, to in gaps]
            outside = [step(edge, to) for edge, to in edges] + [edge for edge, _ in gaps]
            yield (
                f"{name}.{key}",
                tuple(number(value) for value in inside),
                tuple(number(value) for value in outside),
            )


def stated(key: str, value: float) -> str:
    return f"{key}={[value] * 3 if key == 'drive.torques' else value}"


def taken(scene: NamedScene) -> dict[str, Any]:
    """What each model says to a scene that has been read, before anything is meshed or solved."""
    answers: dict[str, Any] = {}
    try:
        given = hcm_scene(scene, estimate=False)
        check_scene(given.finger, given.surface, given.drive)
        check_size(given.finger, given.settings)
    except (UserError, hcm.ParameterError) as error:
        answers["hcm"] = str(error)
    try:
        solid_inputs.finger_geometry(scene.tables)
        solid_inputs.solid_parts(scene.tables)
    except ValueError as error:
        answers["solid"] = str(error)
    return answers


def test_all_numbers_of_a_scene_are_bounded() -> None:
    found = {key: (inside, outside) for key, inside, outside in extremes()}
    assert len(found) > 12
    for key, (inside, outside) in found.items():
        assert inside, key
        for value in outside:
            with pytest.raises(UserError, match=re.escape(key)):
                load_scene("soft", [stated(key, value)])


def test_what_the_scene_accepts_both_models_take() -> None:
    choices = [stated(key, value) for key, inside, _ in extremes() for value in inside]
    accepted = 0
    for overrides in itertools.chain(((c,) for c in choices), itertools.combinations(choices, 2)):
        try:
            scene = load_scene("soft", overrides)
        except UserError:  # of parts that do not fit, before any model is asked
            continue
        accepted += 1
        assert taken(scene) == {}, overrides
    assert accepted > 100
