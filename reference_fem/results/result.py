"""What a run returns: status, history, fields and summary, for the FULL body.

A half model's forces, energies and areas are doubled before they get here.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from enum import Enum
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from reference_fem.arrays import Array
from reference_fem.results.dataset import run_dataset, versions
from reference_fem.results.notebook import run_html

if TYPE_CHECKING:
    import xarray


class Status(Enum):
    """Outcome of a run; `advice` says what a user can do about it."""

    COMPLETED = "completed"
    NOT_REACHED = "not reached"
    STILL_IN_CONTACT = "still in contact"
    UNSTABLE = "unstable"
    ENERGY_LOST = "energy lost"
    INVERTED_ELEMENT = "inverted element"
    PASSED_THROUGH = "passed through"
    WORK_LIMIT = "work limit"
    INTERRUPTED = "interrupted"

    @property
    def advice(self) -> str:
        """What to do next; empty for a completed run."""
        return _ADVICE[self]


_ADVICE = {
    Status.COMPLETED: "",
    Status.NOT_REACHED: (
        "the tip never came down to the surface: lower surface.height, turn drive.torques towards "
        "it, or raise solver.fem.max_flight_time or solver.fem.end_time"
    ),
    Status.STILL_IN_CONTACT: (
        "the window ended before the finger left the surface, or before solver.fem.tap_until: "
        "raise solver.fem.end_time or, without one, solver.fem.max_contact_time"
    ),
    Status.UNSTABLE: (
        "the energy balance is lost: lower solver.fem.step_factor (above 0.9 the steps have no "
        "reserve), soften the contact, or use a mesh without slivers"
    ),
    Status.ENERGY_LOST: (
        "solver.fem.contact = 'impulse' stops every node that arrives as in a plastic impact: "
        "refine the mesh where it touches (solver.fem.tip_size), or use 'surface'"
    ),
    Status.INVERTED_ELEMENT: (
        "an element turned inside out: use a stiffer material, a slower impact or a softer "
        "contact; a soft finger that flew as rigid bodies may arrive too fast: let it bend on its "
        "way (solver.fem.flight = 'coarse')"
    ),
    Status.PASSED_THROUGH: (
        "this model lets only the last phalanx touch: try another surface.height, mostly a larger "
        "one, or torques (drive.torques; the last phalanx's first) that keep the tip lowest"
    ),
    Status.WORK_LIMIT: (
        "the run is longer than it was meant to be: shorten solver.fem.end_time, coarsen the mesh, "
        "or raise solver.fem.max_steps"
    ),
    Status.INTERRUPTED: "stopped by the user: what was computed up to there is in the result",
}


Number = TypeVar("Number", float, Array)


@dataclass(frozen=True)
class Sampled(Generic[Number]):
    """Quantities sampled in the explicit run, once (`Sample`) or n times (`History`).

    Energies are measured from the finger along -X at rest, so that their balance, less the energy
    of the start, covers a skipped flight as well.
    """

    time_s: Number
    """Since the start of the motion, (n,)."""
    normal_force_N: Number
    """On the tip, pushing up, (n,)."""
    tangential_force_N: Number
    """On the tip, along +X, (n,)."""
    tip_position_m: Array
    """Of the pole, the tip's end on the axis, (n, 2)."""
    tip_velocity_m_per_s: Array
    """Of the same point, (n, 2)."""
    stress_R_Pa: Number
    """Axial Cauchy stress at R, mid-length of the last phalanx, lower surface, (n,)."""
    kinetic_energy_J: Number
    """(n,)"""
    strain_energy_J: Number
    """Of the elements, (n,)."""
    hourglass_energy_J: Number
    """Strain energy held by hourglass control, 0 for elements without it, (n,)."""
    gravity_energy_J: Number
    """(n,)"""
    contact_energy_J: Number
    """Of the contact law's normal and tangential springs, (n,)."""
    friction_dissipation_J: Number
    """(n,)"""
    contact_damping_J: Number
    """Losses of dashpots and of the lumped law's hysteresis, (n,)."""
    material_dissipation_J: Number
    """Of the elements' relaxation, (n,)."""
    drive_work_J: Number
    """Of the joints' torques, (n,)."""
    energy_balance_J: Number
    """Kinetic + strain + gravity + contact energy + friction dissipation + contact damping +
    material dissipation - drive work, less the energy of the start, (n,): the discretization's."""
    coulomb_excess_N: Number
    """Largest |f_t| - μ f_n over the nodes in contact, (n,)."""
    contact_area_m2: Number
    """Tributary area of the nodes or quadrature points in contact; a round patch has the radius
    sqrt(area/π), (n,)."""
    peak_pressure_Pa: Number
    """Largest contact pressure of a node, averaged over its tributary area, (n,)."""
    hinge_reactions_N: Array
    """Force that hinge w exerts on phalanx w, (n, P, 2)."""
    next_touch_s: Number
    """Time until the last phalanx would touch as a rigid body, huge if it goes up, (n,)."""


class Sample(Sampled[float]):
    """The numbers of one audit; the arrays lack their first axis."""

    @property
    def finite(self) -> bool:
        """Whether energy balance and kinetic energy are finite."""
        return math.isfinite(self.energy_balance_J) and math.isfinite(self.kinetic_energy_J)


class History(Sampled[Array]):
    """Samples in order of time."""


@dataclass(frozen=True)
class ForceRecord:
    """Contact at every step of the window, arrays of length s (the history is only sampled).

    time_s, normal_force_N, tangential_force_N : (s,)
    lowest_gap_m : (s,), height of the lowest surface node above the plane
    """

    time_s: Array
    normal_force_N: Array
    tangential_force_N: Array
    lowest_gap_m: Array

    def until(self, time_s: float) -> "ForceRecord":
        """The steps up to a time, s."""
        steps = int(np.searchsorted(self.time_s, time_s, side="right"))
        return ForceRecord(*(getattr(self, f.name)[:steps] for f in fields(self)))


@dataclass(frozen=True)
class Snapshot:
    """Fields at one time, on the mesh as given (a half model stays half).

    time_s : absolute time
    displacement, velocity : (n_points, dim), m and m/s, at the same time
    von_mises_Pa : (n_cells,)
    contact_pressure_Pa : (n_points,), normal force of each node over its tributary area; zero off
        the patch.
    at_peak : True for the snapshot nearest to the peak normal force
    """

    time_s: float
    displacement: Array
    velocity: Array
    von_mises_Pa: Array
    contact_pressure_Pa: Array
    at_peak: bool = False


@dataclass(frozen=True, kw_only=True)
class Summary:
    """The scalars of a tap; None where a quantity has no meaning (no contact, no friction).

    They describe the FIRST tap: from the first touch to the separation. See `summary` for the
    definitions of the transitions. The last five describe the run: largest |balance error| over the
    largest kinetic energy, wall time, explicit steps, elements of the full body, and Δt.
    """

    contact_time_s: float | None = None
    tip_velocity_at_contact_m_per_s: tuple[float, float] | None = None
    peak_normal_force_N: float | None = None
    peak_normal_force_time_s: float | None = None
    first_peak_normal_force_N: float | None = None
    peak_tangential_force_N: float | None = None
    contact_duration_s: float | None = None
    normal_impulse_N_s: float | None = None
    compression_to_restitution: int | None = None
    stick_to_slip: int | None = None
    slip_to_stick: int | None = None
    reverse_slip: bool | None = None
    peak_stress_R_Pa: float | None = None
    energy_residual: float | None = None
    wall_time_s: float
    steps: int
    elements: int
    time_step_s: float

    @property
    def first_tap_end_s(self) -> float:
        """When the first tap ended, s; infinite if there is none, or it has not."""
        if self.contact_time_s is None or self.contact_duration_s is None:
            return math.inf
        return self.contact_time_s + self.contact_duration_s


@dataclass(frozen=True)
class TapResult:
    """A run's outcome.

    status, message : how it ended, in one word and in one sentence with numbers and remedy
    history, forces, snapshots, summary : see the classes. After a failure they hold what was
        computed before it.
    cautions : reasons not to trust the numbers, one sentence each; see `cautions`.
    errors : estimated absolute errors by the summary's names; inf where none can be given, empty if
        none were asked for or the run is not complete.
    mesh_errors : parts of them that a finer mesh may reduce; from the edges alone if the tap's end
        is in doubt (another mesh's tap may end otherwise), empty if its first touch is in doubt.
    given : arguments of `simulate` by name; a mesh by its SHA-256.
    """

    status: Status
    message: str
    history: History
    forces: ForceRecord
    snapshots: tuple[Snapshot, ...]
    summary: Summary
    cautions: tuple[str, ...] = ()
    errors: Mapping[str, float | tuple[float, float]] = field(default_factory=dict)
    mesh_errors: Mapping[str, float] = field(default_factory=dict)
    given: Mapping[str, Any] = field(default_factory=dict)

    def to_dataset(self) -> "xarray.Dataset":
        """History, forces of every step (``step_*``), numbers and errors with units.

        Arguments and versions are in the attributes; fields are left out.
        """
        return run_dataset(
            {"time": vars(self.history), "step": vars(self.forces)},
            asdict(self.summary),
            self.errors,
            title="a tap of the finite elements (reference_fem)",
            status=self.status.name,
            message=self.message,
            cautions=self.cautions,
            given=self.given,
            versions=versions("fingertap", "numpy", "numba", "scikit-fem"),
        )

    def _repr_html_(self) -> str:
        notes = (f"{self.status.name} {self.message}", *self.cautions)
        time, force = self.forces.time_s, self.forces.normal_force_N
        return run_html(notes, asdict(self.summary), self.errors, time, force)
