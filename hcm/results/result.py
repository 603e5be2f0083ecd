"""What a run returns: history, events, statistics and summary."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hcm.arrays import Floats
from hcm.results.dataset import run_dataset, versions
from hcm.results.notebook import run_html
from hcm.results.posture import Posture
from hcm.results.status import Status

if TYPE_CHECKING:
    import xarray

    from hcm.results.force_curve import ForceCurve


# Columns of the table that the compiled loop writes; `History` has them under names with units.
COLUMNS = (
    "time", "normal_force", "tangential_force", "tip_x", "tip_y", "tip_vx", "tip_vy",
    "particle_velocity", "stress_R", "kinetic", "strain", "gravity", "contact_energy",
    "friction_loss", "restitution_loss", "material_loss", "drive_work", "mode",
)  # fmt: skip
EVENT_KINDS = (
    "contact",
    "compression_to_restitution",
    "restitution_to_compression",
    "stick_to_slip",
    "slip_to_stick",
    "separation",
)


@dataclass(frozen=True)
class Event:
    """A located transition: time_s since the start of the motion, kind one of EVENT_KINDS."""

    time_s: float
    kind: str


@dataclass(frozen=True)
class History:
    """Values at accepted steps, and at the stages of `gauss` in contact; n rows, P phalanges."""

    time_s: Floats
    """Since the start of the motion, (n,)."""
    normal_force_N: Floats
    """On the tip, pushing up, (n,)."""
    tangential_force_N: Floats
    """On the tip, along +X, (n,)."""
    tip_position_m: Floats
    """Of the end of the last phalanx's axis, (n, 2)."""
    tip_velocity_m_per_s: Floats
    """Of the same point, (n, 2)."""
    particle_velocity_m_per_s: Floats
    """Of the point between spring and surface, along +X, (n,); the tip's in flight."""
    stress_R_Pa: Floats
    """Axial stress at R, mid-length of the last phalanx, lower surface, (n,)."""
    kinetic_energy_J: Floats
    """(n,)"""
    strain_energy_J: Floats
    """Of the phalanges, (n,)."""
    gravity_energy_J: Floats
    """(n,)"""
    contact_energy_J: Floats
    """What the contact's springs could give back, (n,)."""
    friction_dissipation_J: Floats
    """With the work that a refined tip's softening by friction takes; it may fall a little while
    the tip sticks, (n,)."""
    restitution_dissipation_J: Floats
    """Lost from compression to restitution, (n,)."""
    material_dissipation_J: Floats
    """Of the phalanges' damping and of a radiating tip, (n,)."""
    drive_work_J: Floats
    """Of the joints' torques, (n,)."""
    mode: NDArray[np.int8]
    """3 x (0 flight, 1 compression, 2 restitution) + (0 free, 1 stick, 2 slip), (n,)."""
    hinge_reactions_N: Floats
    """Force that hinge w exerts on phalanx w, -lam_w, (n, P, 2)."""

    @property
    def energy_balance_J(self) -> Floats:
        """Energy held and lost, less the drive's work and the energy at the start; 0 if exact."""
        total = (
            self.kinetic_energy_J
            + self.strain_energy_J
            + self.gravity_energy_J
            + self.contact_energy_J
            + self.friction_dissipation_J
            + self.restitution_dissipation_J
            + self.material_dissipation_J
            - self.drive_work_J
        )
        return total - total[0]


def history_of(table: Floats, reactions: Floats) -> History:
    """A history as views of the loop's tables.

    table : (n, len(COLUMNS)) in the order of `COLUMNS`. reactions : (n, 2 P), lam.
    """
    columns = list(table.T)
    values: list[Any] = [
        *columns[:3], table[:, 3:5], table[:, 5:7], *columns[7:17], columns[17].astype(np.int8),
        -reactions.reshape(len(table), -1, 2),
    ]  # fmt: skip
    return History(*values)


@dataclass(frozen=True)
class Statistics:
    """What a run cost.

    steps : accepted, and stages of collocation's in contact. newton_iterations, factorizations : of
    the beams; a collocation step iterates on all s stages together, and one of its factorizations
    counts (s + 1)//2 systems.
    rejected_steps : repeated because Newton's method failed, an error bound was exceeded or an
    event search failed. event_trials : trial steps of the event search. chatter_steps : whole steps
    taken through chatter. wall_time_s : of the solve, without the runs that estimate its errors.
    """

    steps: int
    newton_iterations: int
    factorizations: int
    rejected_steps: int
    event_trials: int
    chatter_steps: int
    wall_time_s: float


@dataclass(frozen=True)
class Summary:
    """Scalars of the first tap; None where the run did not get that far.

    Peak times and durations count from first contact. peak_tangential_force_N is the signed value
    of largest magnitude. energy_residual is the largest |energy balance| over the largest kinetic
    energy of the whole run, or over strain energy's round-off if that is larger (at rest).
    """

    contact_time_s: float | None
    tip_velocity_at_contact_m_per_s: tuple[float, float] | None
    peak_normal_force_N: float | None
    peak_normal_force_time_s: float | None
    first_peak_normal_force_N: float | None
    peak_tangential_force_N: float | None
    contact_duration_s: float | None
    normal_impulse_N_s: float | None
    compression_to_restitution: int
    stick_to_slip: int
    slip_to_stick: int
    reverse_slip: bool
    peak_stress_R_Pa: float | None
    energy_residual: float


@dataclass(frozen=True)
class Choice:
    """A setting that a wanted accuracy chose, its value, and why."""

    setting: str
    value: object
    reason: str


@dataclass(frozen=True)
class Accuracy:
    """The accuracy asked of a run, and the settings chosen for it.

    wanted : largest relative error of peak force, impulse, duration and arrival. expected : the
    largest by the run's estimates; None if none were asked for.
    """

    wanted: float
    expected: float | None
    choices: tuple[Choice, ...]


Errors = Mapping[str, float | tuple[float, float]]
"""Absolute errors of the summary's numbers, by its fields."""


class OtherEnd(NamedTuple):
    """An end that a first tap nearly had, with the touches that begin within `until_s` of its first
    one: the rule (`hcm.taps.tap`) compared a time that is `apart_s` from its `threshold_s`.
    """

    until_s: float
    apart_s: float
    threshold_s: float


@dataclass(frozen=True)
class TapResult:
    """A run of the reduced model.

    message says where and why a run that is not COMPLETED ended. event_postures go with events,
    frames with `Settings.frame_times` as far as the run got. errors : estimated absolute errors of
    the summary's main numbers, by its fields, SI units; inf where nothing is known, empty if none
    were asked for or the run is not COMPLETED. cautions : what to know before relying on it.
    accuracy : None unless the run was held to one. taps : first touch and last separation of each,
    s; inf if it has not ended. other_ends : ends that the first tap nearly had. given : what
    `simulate` was given, by its parameters' names.
    """

    status: Status
    message: str
    history: History
    events: tuple[Event, ...]
    statistics: Statistics
    summary: Summary
    event_postures: Sequence[Posture]
    frames: Sequence[Posture]
    errors: Errors = field(default_factory=dict)
    cautions: tuple[str, ...] = ()
    accuracy: Accuracy | None = None
    taps: tuple[tuple[float, float], ...] = ()
    other_ends: tuple[OtherEnd, ...] = ()
    given: Mapping[str, Any] = field(default_factory=dict)

    def as_ended(
        self, status: Status = Status.INTERRUPTED, doubt: str = " while it was repeated"
    ) -> "TapResult":
        """A completed run that its repetition ended or threw doubt on, and so has no errors."""
        message = status.at(self.history.time_s[-1], self.statistics.steps) + doubt
        return replace(self, status=status, message=message, errors={})

    @property
    def forces(self) -> "ForceCurve | None":
        """The contact force between the history's rows too, if collocation's steps are long."""
        from hcm.results.force_curve import force_curve

        return force_curve(self.history, self.given) if self.given else None

    def to_dataset(self) -> "xarray.Dataset":
        """History, events, numbers and errors with units; inputs and versions as attributes.

        `forces` have the prefix ``step_``, or the history's where each of its rows is a step's end.
        """
        from hcm.results.force_curve import ForceCurve

        curve = self.forces or self.history
        events = {
            "time_s": np.array([event.time_s for event in self.events]),
            "kind": np.array([event.kind for event in self.events], dtype=str),
        }
        return run_dataset(
            {
                "time": vars(self.history),
                "step": {one.name: getattr(curve, one.name) for one in fields(ForceCurve)},
                "event": events,
            },
            asdict(self.summary),
            self.errors,
            title="a tap of the reduced model (hcm)",
            status=self.status.name,
            message=self.message,
            cautions=self.cautions,
            statistics=self.statistics,
            given=self.given,
            versions=versions("fingertap", "numpy", "numba"),
        )

    def _repr_html_(self) -> str:
        notes = (f"{self.status.name} {self.message}", *self.cautions)
        curve = self.forces or self.history
        of = asdict(self.summary), self.errors, curve.time_s, curve.normal_force_N
        return run_html(notes, *of)
