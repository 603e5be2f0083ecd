"""The common form in which every model returns a run."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from validation.harness.quantities import ESTIMATED, SOLID_KEYS, SUMMARY_KEYS, finite

if TYPE_CHECKING:
    import xarray

Floats = NDArray[np.float64]
Scalar = float | int | bool | str | None
MACHINE_SCALARS = ("wall_time_s", "peak_memory_MB")
"""Scalars that depend on the machine, not on the tap: they differ from run to run."""
FORCE_COLUMNS = ("time_s", "normal_force_N", "tangential_force_N")


class Event(NamedTuple):
    """A located transition."""

    time_s: float
    kind: str


@dataclass(frozen=True)
class RunRecord:
    """One run of one model on one scene.

    scene, model, variant : names; the variant is the preset or tells what was changed.
    status : name of the model's own status; ``ok`` says whether the run completed.
    message : what happened and what to do, or cautions; empty when all went well.
    summary : scalars by key of `quantities.QUANTITIES`; None where a model has none.
    errors : estimated absolute errors, by keys of the summary, in the same units; infinite where
        one could not be estimated, empty where none was asked for.
    history : arrays over time, units in the names; the first axis is time.
    forces : contact forces at every step, ``time_s, normal_force_N, tangential_force_N, ...``, of a
        model whose history is sampled; empty if the history has every step.
    events : located transitions in order of time.
    statistics : counts of the solver's work.
    accuracy : for a run that was held to one, ``wanted``, ``expected`` (None: not estimated) and
        ``choices``, each with ``setting``, ``value`` as text, ``reason``.
    provenance : scene as TOML tables, versions, machine, when it was measured.
    read_back : whether it comes from a store: its time and memory were measured earlier.
    """

    scene: str
    model: str
    variant: str
    status: str
    ok: bool
    message: str
    summary: Mapping[str, Any]
    errors: Mapping[str, Any] = field(default_factory=dict)
    history: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    forces: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    statistics: Mapping[str, Scalar] = field(default_factory=dict)
    accuracy: Mapping[str, Any] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    read_back: bool = False

    @property
    def measured(self) -> str:
        """When the run's time and memory were measured, and whether they are read back."""
        when = str(self.provenance.get("created", ""))
        return f"{when}, read back" if self.read_back else when

    @property
    def contact_forces(self) -> Mapping[str, NDArray[Any]]:
        """``time_s, normal_force_N, tangential_force_N`` at every step, also of a sampled run."""
        return self.forces or self.history

    @property
    def label(self) -> str:
        """Model and variant, as tables and figures write it."""
        return f"{self.model} {self.variant}".strip()

    @property
    def doubt(self) -> str:
        """The run's message, after its status if it did not complete; may be empty."""
        return self.message if self.ok else f"{self.status}: {self.message}"

    def value(self, key: str) -> float | None:
        """One scalar as a finite float, or None."""
        return finite(self.summary.get(key))

    def with_summary(self, **scalars: Scalar) -> Self:
        """A copy with some scalars replaced."""
        return replace(self, summary={**self.summary, **scalars})

    def to_json(self) -> dict[str, Any]:
        """The object that ``fingertap run --json`` prints."""
        values = {key: plain(self.summary.get(key)) for key in SUMMARY_KEYS + SOLID_KEYS}
        return {
            "scene": self.scene,
            "model": self.model,
            **{k: v for k, v in values.items() if v is not None or k not in SOLID_KEYS},
            "error_estimates": plain({k: self.errors[k] for k in ESTIMATED if k in self.errors}),
            **({"accuracy": plain(self.accuracy)} if self.accuracy else {}),
        }

    def to_dataset(self) -> "xarray.Dataset":
        """The content of ``history.nc``: curves, numbers and errors, with units and provenance.

        `contact_forces` are there too, with the prefix ``step_`` and a dimension ``step``.
        """
        from hcm.results.dataset import run_dataset

        rows = {name: self.history[name] for name in FORCE_COLUMNS if name in self.history}
        return run_dataset(
            {"time": self.history, "step": self.forces or rows},
            {name: value for name, value in self.summary.items() if name not in MACHINE_SCALARS},
            self.errors,
            title=f"fingertap: {self.scene}, {self.label}",
            status=self.status,
            message=self.message,
            summary=self.to_json(),
            events=self.events,
            provenance=plain(self.provenance),
        )

    def _repr_html_(self) -> str:
        from hcm.results.notebook import run_html

        notes = (f"{self.scene}, {self.label}: {self.status} {self.message}",)
        time, force = (self.contact_forces.get(name, np.zeros(0)) for name in FORCE_COLUMNS[:2])
        return run_html(notes, self.summary, self.errors, time, force)


def plain(value: Any) -> Any:
    """The value as JSON can carry it: no NaN, no infinity, no NumPy types."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
