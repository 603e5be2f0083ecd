"""What adapters share: the types of their contract, and the record of a model's result."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from validation.harness.provenance import provenance
from validation.harness.quantities import QUANTITIES
from validation.harness.record import Event, RunRecord
from validation.harness.run_files import Fields
from validation.scenes.load import NamedScene
from validation.scenes.scene import Scene
from validation.scenes.tables import TorqueTable

Progress = Callable[[float, str], None]  # fraction done in 0..1, what is being done


def part(progress: Progress, low: float, high: float) -> Progress:
    """A callback whose fractions 0..1 become low..high of another's."""
    return lambda fraction, text: progress(low + (high - low) * fraction, text)


@dataclass(frozen=True)
class Checkpoint:
    """Where a long run saves the state of its first solve, and whether to continue from there."""

    path: Path
    resume: bool = False

    def of_solve(self, number: int) -> Path:
        """The file of one of a run's solves, counted from 1."""
        return self.path if number == 1 else self.path.with_stem(f"{self.path.stem}-{number}")

    def remove(self) -> None:
        """Remove the files of all solves, and what a kill in the midst of writing one has left."""
        folder, stem, suffix = self.path.parent, self.path.stem, self.path.suffix
        left = folder.glob(f".{stem}*{suffix}.*.partial")
        for file in (self.path, *folder.glob(f"{stem}-[0-9]{suffix}"), *left):
            file.unlink(missing_ok=True)


@dataclass(frozen=True)
class Outcome:
    """A run's record and, from solid models, its fields.

    mesh_error : for a solid, the largest relative error that a finer mesh may reduce, among the
        numbers that an accuracy applies to; None: not known.
    """

    record: RunRecord
    fields: Fields | None = None
    mesh_error: float | None = None


Kind = Literal["reduced", "reference"]


class Adapter(Protocol):
    """A model as every command sees it; its package is imported inside these functions.

    name : its name on the command line and in tables.
    kind : "reduced" models are compared with "reference" ones.
    settings : NAME of the scene's table ``[solver.NAME]`` that it reads: hcm, fem or "" (none).
    sources : dotted names of the modules whose code makes its results, by which the store knows
        them; imports of this project's packages are followed. Of another project's package all
        files count, data too, and of the packages that it imports from a folder or an editable
        install: no run may write there.
    resumable : whether it writes a restart file at the checkpoint as it goes.
    independent_of : packages of this project that have no part in its results, though reading a
        scene imports them
    """

    name: str
    kind: Kind
    settings: str
    resumable: bool
    sources: tuple[str, ...]
    independent_of: tuple[str, ...]

    def refusal(self, scene: NamedScene) -> str:
        """Why it can't take this scene, with the remedy; empty if it can (the default)."""
        del scene
        return ""

    def warm_up(self) -> None:
        """Run a tiny scene, so that compiled code is loaded before anything is timed."""

    def run(
        self,
        scene: NamedScene,
        progress: Progress | None = None,
        checkpoint: Checkpoint | None = None,
    ) -> Outcome:
        """Translate the scene and time the solve alone.

        The solver's status becomes the record's. A model without restart files ignores the
        checkpoint.

        Raises UserError: the model cannot take this scene.
        """


def drive_of(tables: Scene, solver: Any) -> Any:
    """A scene's drive in the form that `solver` takes, the package hcm or reference_fem."""
    drive, torques = tables.drive, tables.drive.torques
    if isinstance(torques, TorqueTable):
        given = {"table": solver.TorqueTable(torques.time, torques.values)}
    else:
        given = {"torques": torques or ()}
    return solver.Drive(
        **given, gravity=drive.gravity, reaction=drive.reaction, incline=tables.surface.incline
    )


def _members(source: object) -> dict[str, Any]:
    return {} if source is None else dict(vars(source))


def _arrays(source: object) -> dict[str, NDArray[Any]]:
    return {name: np.asarray(a) for name, a in _members(source).items() if a is not None}


def _accuracy(result: object) -> dict[str, Any]:
    accuracy = getattr(result, "accuracy", None)
    if accuracy is None:
        return {}
    choices = [{**vars(choice), "value": shown(choice.value)} for choice in accuracy.choices]
    return {"wanted": accuracy.wanted, "expected": accuracy.expected, "choices": choices}


def shown(value: Any) -> str:
    """A setting's value as the text that a record's accuracy holds."""
    if isinstance(value, tuple | list):
        return ", ".join(map(shown, value))
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def to_record(result: Any, scene: NamedScene, model: str, variant: str = "") -> RunRecord:
    """Convert a model's ``TapResult`` to the common record.

    result : object with status, message, history, summary and, where the model has them, forces (of
        every step), events, statistics, cautions, errors and accuracy. Its summary or its
        statistics have the number of steps and the duration of the solve alone.
    """
    summary = {entry.key: getattr(result.summary, entry.key, None) for entry in QUANTITIES}
    statistics = _members(getattr(result, "statistics", None))
    for key in ("steps", "wall_time_s"):
        if summary[key] is None:
            summary[key] = statistics.get(key)
    status = result.status
    ok = status.name == "COMPLETED"
    advice = "" if status.advice in result.message else status.advice
    message = ": ".join(filter(None, (result.message, advice)))
    if ok:
        message = "; ".join(getattr(result, "cautions", ()))
    return RunRecord(
        scene=scene.name,
        model=model,
        variant=variant,
        status=status.name,
        ok=ok,
        message=" ".join(message.split()),
        summary=summary,
        errors=dict(getattr(result, "errors", {})),
        history=_arrays(result.history),
        forces=_arrays(getattr(result, "forces", None)),
        events=tuple(Event(float(e.time_s), str(e.kind)) for e in getattr(result, "events", ())),
        statistics=statistics,
        accuracy=_accuracy(result),
        provenance=provenance(scene.document),
    )
