"""The runs of a convergence study, each kept as soon as it is there."""

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from validation.converge.refinements import QUANTITIES, Overrides
from validation.errors import RunFailedError, UserError
from validation.harness.console import say
from validation.harness.files import write_json
from validation.harness.interrupts import unless_interrupted
from validation.harness.record import plain
from validation.models import solid
from validation.scenes.load import NamedScene, load_scene

KEPT = (
    *QUANTITIES,
    "peak_normal_force_time_s",
    "peak_tangential_force_N",
    "peak_stress_R_Pa",
    "energy_residual",
    "elements",
    "time_step_s",
    "steps",
    "wall_time_s",
)
DIMENSIONS: dict[str, solid.Dimension] = {"fem3d": 3, "fem2d": 2}

Progress = Callable[[float, str], None]
Values = dict[str, float | None]


class LevelRuns:
    """Runs of one scene on one model, all from the same impact state.

    Parameters
    ----------
    source, overrides
        As `load_scene` takes them.
    model
        fem3d or fem2d.
    folder
        Where results are kept, and found again by a later study.
    """

    def __init__(self, source: str, overrides: Sequence[str], model: str, folder: Path) -> None:
        self._source, self._given, self._folder = source, tuple(overrides), folder
        self._dimension = DIMENSIONS[model]
        self.scene: NamedScene = load_scene(source, overrides)
        try:
            self._start = solid.impact_state(self.scene.tables, self._dimension)
        except ValueError as error:
            raise UserError(f"scene {self.scene.name}: {error}") from error
        if self._start is None:
            raise RunFailedError(
                f"scene {self.scene.name}: the surface is not reached: lower surface.height"
            )

    def run(self, level: Overrides, progress: Progress | None = None) -> Values:
        """Scalars of one level, from an earlier study with the same inputs and program if any.

        Raises
        ------
        RunFailedError
            The run did not complete.
        """
        import reference_fem
        from reference_fem.dynamics.restart import identity

        assert self._start is not None
        texts = [f"{key}={value!r}" for key, value in level.items() if not isinstance(value, str)]
        texts += [f"{key}={value}" for key, value in level.items() if isinstance(value, str)]
        tables = load_scene(self._source, (*self._given, *texts)).tables
        try:
            mesh = solid.build_mesh(tables, self._dimension)
            materials, surface, drive, settings = solid.inputs(tables)
        except ValueError as error:
            raise UserError(f"scene {self.scene.name}: {error}") from error
        inputs = {"mesh": mesh, "materials": materials, "surface": surface, "drive": drive}
        run = identity(**inputs, settings=settings, start=self._start)
        name = hashlib.sha256(json.dumps(run, sort_keys=True).encode()).hexdigest()[:16]
        path = self._folder / f"{name}.json"
        kept = _kept(path)
        if kept is not None:
            return kept
        result = unless_interrupted(
            reference_fem.simulate(
                mesh, materials, surface, drive, settings, progress, start=self._start
            )
        )
        if result.status is not reference_fem.Status.COMPLETED:
            raise RunFailedError(f"scene {self.scene.name}, {dict(level)}: {result.message}")
        values: dict[str, Any] = {key: plain(getattr(result.summary, key)) for key in KEPT}
        content = {"level": dict(level), "values": values, "identity": run}
        write_json(path, content | {"digest": _digest(values)})
        return values


def _digest(values: Values) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


def _kept(path: Path) -> Values | None:
    """The values in a file of an earlier study; None if there is none, or not as it was written."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        values: Values = content["values"]
        if content["digest"] == _digest(values):
            return values
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        pass
    say(f"{path}: truncated or altered; this level is run again")
    return None
