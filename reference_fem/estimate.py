"""Estimated errors of a completed run's numbers, of the first tap.

Arrival and speed: `flight_error`, and with it what a force or a time follows of the speed. The tap:
a companion, a mesh of other edges, coarser or finer, taps from the run's own impact state
(`mesh_error`). What a flight leaves out and what a mesh does have nothing to do with each other:
their squares add up (JCGM 100, 5.1.2).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.cautions import SPIKE, flutter, grain, imprecise, percent, spike
from reference_fem.flight_error import Flight, Unseen, arrival_errors, power, unseen
from reference_fem.mesh_error import (
    IMPULSE,
    PEAK,
    STRESS,
    Other,
    Resolution,
    hertz_radius,
    rivals,
    spacing,
    tap_errors,
)
from reference_fem.model import Model
from reference_fem.other_ends import other_ends
from reference_fem.result import Status, TapResult
from reference_fem.rigid_chain import ChainState, RigidChain, chain_and_start
from reference_fem.rigid_flight import Descent, descent, surface_gap
from reference_fem.settings import Drive, Material, Settings
from reference_fem.true_body import true_chain, true_gap

Errors = dict[str, float | tuple[float, float]]
Again = Callable[[meshes.FingerMesh, ChainState], TapResult]

VELOCITY = "tip_velocity_at_contact_m_per_s"

ELSEWHERE = (
    "the round end's own flight comes to another touch: it grazes the surface, or magnifies small "
    "differences, so that no mesh tells which touch is the first: start nearer to it ([start])"
)
RINGS = "what bends, stretches and rings on the way changes the tap by {}: {}"
REMEDY = {
    "rigid": "let the elements fly (solver.fem.flight = 'coarse', or 'explicit'), or start nearer",
    "coarse": "let the run's own elements fly (solver.fem.flight = 'explicit'), or start nearer",
}
ALONE = "errors are estimated from this mesh's edges alone, for lack of a coarser one"
# Of the impulse, what a flight leaves out beyond which a run carries a caution.
LARGEST_LEFT_OUT = 0.01
# The companion starts with this share of the tip's radius below it, more than the lowest nodes of
# any mesh lie above the round end.
CLEARANCE = 0.05


@dataclass(frozen=True)
class Given:
    """What a run was made from, and its rigid flight if it had one."""

    mesh: meshes.FingerMesh
    model: Model
    materials: Sequence[Material]
    drive: Drive
    settings: Settings
    start: ChainState | None
    flown: Descent | None

    @property
    def radius(self) -> float:
        """Of the touching end, m."""
        touching = self.model.body_of_point == self.model.touching_body
        return float(np.abs(self.model.points[touching, 1]).max())

    @property
    def section(self) -> float:
        """Length of the first shaft's cells over the diameter of the end that touches."""
        cells = np.asarray(self.mesh.cell_sets["phalanx_1"])
        lengths = np.ptp(self.mesh.points[self.mesh.cells[cells], 0], axis=1)
        return float(lengths.mean()) / (2.0 * self.radius)


def estimated(
    run: TapResult, given: Given, companion: meshes.FingerMesh | None, again: Again
) -> TapResult:
    """A completed run with estimates of its errors, and a caution where one is large.

    Parameters
    ----------
    again : taps with another mesh from a rigid state

    Raises
    ------
    KeyboardInterrupt
        The companion was interrupted.
    """
    chain, first = chain_and_start(given.model.chain, given.start)
    gap = surface_gap(given.model, chain)
    flown = given.flown or descent(chain, gap, first, given.settings)
    speed = run.summary.tip_velocity_at_contact_m_per_s
    if run.summary.contact_time_s is None or speed is None or flown is None:
        return run
    if companion is None and not isinstance(given.settings.contact, str):
        return run  # a lumped law has no patch to resolve
    flight = Flight(chain, gap, given.model.points[[given.model.pole]], flown)
    touch = flight.touch
    angle, fall = float(touch.angles[-1]), max(abs(speed[1]), 1e-300)
    resolution = Resolution(
        spacing(given.mesh, angle),
        hertz_radius(
            run.summary.peak_normal_force_N or 0.0, given.radius, given.materials[-1], angle,
            given.mesh.dim,
        ),
        given.section,
        given.mesh.dim,
    )  # fmt: skip
    errors: Errors = {"contact_time_s": math.inf, VELOCITY: (math.inf, math.inf)}
    late, of_speed, left_out, other = math.inf, 0.0, Unseen(0.0, np.zeros(2)), None
    of_mesh: dict[str, float] = {}
    of_ends: dict[str, float] = {}
    open_ends: tuple[str, ...] = ()
    if given.mesh.shape is not None:
        late, apart = arrival_errors(flight, *_true_body(given, given.mesh.shape))
        if given.settings.flight == "rigid":
            apart = apart + np.abs(flight.pole_velocity(touch) - speed)
        # a node may lie lowest by chance: the middle of a facet is half a diagonal from any
        sagitta_s = (given.mesh.dim - 1) * resolution.edge**2 / (8.0 * given.radius) / fall
        late = max(late, sagitta_s)
        sooner = flight.pole_velocity(flown.before(sagitta_s))
        apart = np.maximum(apart, np.abs(flight.pole_velocity(touch) - sooner))
        of_speed = float(max(apart)) / fall
        if given.settings.flight != "explicit":
            left_out = unseen(
                flight, given.settings.flight, given.drive, given.mesh.shape, given.materials, fall
            )
        errors["contact_time_s"] = late + left_out.late_s
        apart = apart + left_out.apart
        errors[VELOCITY] = float(apart[0]), float(apart[1])
        if companion is not None:
            tap = again(companion, flown.before(CLEARANCE * given.radius / fall))
            if tap.status is Status.INTERRUPTED:
                raise KeyboardInterrupt
            own, its = given.model.symmetry_factor * len(given.model.cells), tap.summary.elements
            at_contact = spacing(companion, angle) / resolution.edge
            # the number of halved cells goes with the logarithm of their edges
            halved = given.mesh.ties.size > 0
            average = at_contact if halved else (own / its) ** (1.0 / given.mesh.dim)
            ratios = (at_contact, average)
            other = Other(tap, ratios)
    if run.summary.contact_duration_s is not None:
        of_tap, of_left = tap_errors(run, other, resolution), dict[str, float]()
        for name in of_tap:
            if value := abs(getattr(run.summary, name)):  # no friction: no tangential force at all
                of_tap[name] += of_speed * power(name) * value
                of_left[name] = left_out.share(name, fall) * value
        waves = 2.0 * given.materials[-1].density * given.materials[-1].bar_speed
        of_left[STRESS] = of_left.get(STRESS, 0.0) + waves * left_out.rung
        of_tap[PEAK] = max(of_tap[PEAK], standing_out(run, given.model))
        of_tap |= rivals(run, of_tap)
        if given.settings.tap_until_s == 0.0:
            of_ends, open_ends = other_ends(run, given.model)
        if max(of_speed, left_out.late_s) < math.inf:  # a companion's tap may have the other end
            alone = tap_errors(run, None, resolution) if open_ends else of_tap
            of_mesh = {"contact_time_s": late, **alone}
        errors |= {
            name: math.hypot(max(error, of_ends.get(name, 0.0)), of_left.get(name, 0.0))
            for name, error in of_tap.items()
        }
    doubts = (*imprecise(run.summary, errors, of_mesh, resolution.coarse), *open_ends)
    # of another touch nothing is known, whatever flies to it
    left = left_out.share(IMPULSE, fall) if of_speed < math.inf else 0.0
    if of_speed == math.inf:
        doubts = (*doubts, ELSEWHERE)
    elif left > LARGEST_LEFT_OUT:
        share = percent(left) if left < math.inf else "an unknown share"
        # a coarse flight leaves the ringing in a phase of chance
        how = "coarse" if left_out.rung > LARGEST_LEFT_OUT * fall else given.settings.flight
        doubts = (*doubts, RINGS.format(share, REMEDY[how]))
    doubts += flutter(
        run.forces, given.model.surface.friction, given.materials[-1], resolution.edge,
        resolution.patch,
    )  # fmt: skip
    if companion is None:
        doubts = (*doubts, ALONE)
    cautions = (*run.cautions, *doubts)
    return replace(run, errors=errors, mesh_errors=of_mesh, cautions=cautions)


def _true_body(
    given: Given, geometry: meshes.FingerGeometry
) -> tuple[RigidChain, Callable[[Array], float]]:
    """Its chain and what ends its flight; a lumped law's point is the run's own."""
    true = true_chain(geometry, given.materials, given.drive, given.mesh.dim)
    if isinstance(given.settings.contact, str):
        return true, true_gap(geometry, given.model.surface.height)
    return true, surface_gap(given.model, true)


def standing_out(run: TapResult, model: Model) -> float:
    """By how much an unresolved peak force (`cautions.SPIKE`) exceeds what is beside it, N.

    A peak h above both sides has a `spike` of 2 h / 3 F.
    """
    start, lasts = run.summary.contact_time_s or 0.0, run.summary.contact_duration_s or 0.0
    normal = run.forces.normal_force_N[run.forces.time_s <= start + lasts]
    share = spike(normal, grain(model))
    return 1.5 * share * float(normal.max()) if share > SPIKE else 0.0
