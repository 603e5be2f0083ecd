"""Estimated errors of a completed run's numbers, of the first tap.

- Arrival and speed: the shape's own flight (`true_body`), which ends where its round outline
  touches. So a facet's sagitta, masses that a mesh kept, an end that barely touches and a chain
  that whirls without order show alike: the last two arrive at another touch, and of the tap nothing
  is known. After a rigid flight the steps that lead to the touch change the speed too: until a wave
  has come from its hinge the tip falls freely. What it leaves out (`left_out`) is read off such a
  flight of phalanges that begin turned by what they bend, and the speed that they ring at; a coarse
  flight has that in a phase of chance.
- The tap: a companion, a mesh of other edges, coarser or finer, taps from the run's own impact
  state (`mesh_error`). A force follows the speed at contact: F ~ v^6/5, t ~ v^-1/5 (Hertz),
  impulse ~ v. A vibration of the speed V that a flight left out goes on in the tap: times change by
  V/v too, and bending waves have a stress of 2 sqrt(E rho) V. So does one that only sets in at the
  touch, where phalanges that were rigid take up their loads (`SETTLES`).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.cautions import SPIKE, flutter, grain, imprecise, percent, spike
from reference_fem.left_out import left_out
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
from reference_fem.rigid_chain import ChainState, RigidChain, chain_and_start, pose
from reference_fem.rigid_flight import Descent, descent, fly, surface_gap
from reference_fem.settings import Drive, Material, Settings
from reference_fem.true_body import true_chain, true_gap

Errors = dict[str, float | tuple[float, float]]
Again = Callable[[meshes.FingerMesh, ChainState], TapResult]

VELOCITY = "tip_velocity_at_contact_m_per_s"
OF_SPEED = {"normal_impulse_N_s": 1.0, "contact_duration_s": 0.2, "peak_normal_force_time_s": 0.2}
"""Powers of the speed at contact that numbers follow; others follow 6/5 (`power`)."""
SETTLES = {"contact_duration_s": 0.25, "peak_normal_force_time_s": 0.25, STRESS: 0.6}
"""Of `LeftOut.settling` over the speed at contact: what it changes in a number, the others 0.36; 19
of 20 change less (152 random fingers with and without, by the reduced model's beams)."""

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
# Of the true shape's flight: ten times the run's own, so that a flight which magnifies differences
# shows by how much, and short of steps that pass over a touch.
TOLERANCE = 1e-10
# Angle by which a phalanx lies otherwise at another touch, rad.
ANOTHER = 0.1


def power(name: str) -> float:
    """Of the speed at contact, which a number follows."""
    return OF_SPEED.get(name, 1.2)


class Unseen(NamedTuple):
    """What a flight leaves out of arrival, s, and of the pole's velocity, (2,) m/s; the speeds that
    phalanges ring at and settle at (`LeftOut`), m/s.
    """

    late_s: float
    apart: Array
    rung: float = 0.0
    settling: float = 0.0

    def share(self, name: str, fall: float) -> float:
        """Relative error of a number of a tap at the speed `fall`, m/s."""
        of_speed = power(name) * float(max(self.apart))
        return (max(of_speed, self.rung) + SETTLES.get(name, 0.36) * self.settling) / fall


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
    flown = given.flown or descent(given.model, chain, first, given.settings)
    speed = run.summary.tip_velocity_at_contact_m_per_s
    if run.summary.contact_time_s is None or speed is None or flown is None:
        return run
    if companion is None and not isinstance(given.settings.contact, str):
        return run  # a lumped law has no patch to resolve
    touch = flown.state_at(flown.touch_s)
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
    late, of_speed, unseen, other = math.inf, 0.0, Unseen(0.0, np.zeros(2)), None
    of_mesh: dict[str, float] = {}
    of_ends: dict[str, float] = {}
    open_ends: tuple[str, ...] = ()
    if given.mesh.shape is not None:
        late, apart = _of_flight(given, chain, touch, first, given.mesh.shape, speed)
        # a node may lie lowest by chance: the middle of a facet is half a diagonal from any
        sagitta_s = (given.mesh.dim - 1) * resolution.edge**2 / (8.0 * given.radius) / fall
        late = max(late, sagitta_s)
        sooner = _pole_velocity(given, chain, flown.before(sagitta_s))
        apart = np.maximum(apart, np.abs(_pole_velocity(given, chain, touch) - sooner))
        of_speed = float(max(apart)) / fall
        if given.settings.flight != "explicit":
            unseen = _unseen(given, chain, flown, given.mesh.shape, fall)
        errors["contact_time_s"] = late + unseen.late_s
        apart = apart + unseen.apart
        errors[VELOCITY] = float(apart[0]), float(apart[1])
        if companion is not None:
            tap = again(companion, flown.before(CLEARANCE * given.radius / fall))
            if tap.status is Status.INTERRUPTED:
                raise KeyboardInterrupt
            own, its = given.model.copies * len(given.model.cells), tap.summary.elements
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
                of_left[name] = unseen.share(name, fall) * value
        waves = 2.0 * given.materials[-1].density * given.materials[-1].bar_speed
        of_left[STRESS] = of_left.get(STRESS, 0.0) + waves * unseen.rung
        of_tap[PEAK] = max(of_tap[PEAK], standing_out(run, given.model))
        of_tap |= rivals(run, of_tap)
        if given.settings.tap_until_s == 0.0:
            of_ends, open_ends = other_ends(run, given.model)
        if max(of_speed, unseen.late_s) < math.inf:  # a companion's tap may have the other end
            alone = tap_errors(run, None, resolution) if open_ends else of_tap
            of_mesh = {"contact_time_s": late, **alone}
        errors |= {
            name: max(error, of_ends.get(name, 0.0)) + of_left.get(name, 0.0)
            for name, error in of_tap.items()
        }
    doubts = (*imprecise(run.summary, errors, of_mesh, resolution.coarse), *open_ends)
    # of another touch nothing is known, whatever flies to it
    left = unseen.share(IMPULSE, fall) if of_speed < math.inf else 0.0
    if of_speed == math.inf:
        doubts = (*doubts, ELSEWHERE)
    elif left > LARGEST_LEFT_OUT:
        share = percent(left) if left < math.inf else "an unknown share"
        # a coarse flight leaves the ringing in a phase of chance
        flight = "coarse" if unseen.rung > LARGEST_LEFT_OUT * fall else given.settings.flight
        doubts = (*doubts, RINGS.format(share, REMEDY[flight]))
    doubts += flutter(
        run.forces, given.model.surface.friction, given.materials[-1], resolution.edge,
        resolution.patch,
    )  # fmt: skip
    if companion is None:
        doubts = (*doubts, ALONE)
    cautions = (*run.cautions, *doubts)
    return replace(run, errors=errors, mesh_errors=of_mesh, flight_error=left, cautions=cautions)


def standing_out(run: TapResult, model: Model) -> float:
    """By how much an unresolved peak force (`cautions.SPIKE`) exceeds what is beside it, N.

    A peak h above both sides has a `spike` of 2 h / 3 F.
    """
    start, lasts = run.summary.contact_time_s or 0.0, run.summary.contact_duration_s or 0.0
    normal = run.forces.normal_force_N[run.forces.time_s <= start + lasts]
    share = spike(normal, grain(model))
    return 1.5 * share * float(normal.max()) if share > SPIKE else 0.0


def _of_flight(
    given: Given,
    chain: RigidChain,
    touch: ChainState,
    first: ChainState,
    geometry: meshes.FingerGeometry,
    read: tuple[float, float],
) -> tuple[float, Array]:
    """Errors of arrival (s) and of the pole's velocity; inf where the true shape has no such touch.

    read : the velocity that the run states.
    """
    true = true_chain(geometry, given.materials, given.drive, given.mesh.dim)
    own = _pole_velocity(given, chain, touch)
    led = np.abs(own - read) if given.flown is not None else np.zeros(2)
    gap = surface_gap(given.model, true)
    if isinstance(given.settings.contact, str):
        gap = true_gap(geometry, given.model.surface.height)
    other = _same_touch(true, first, gap, touch)
    if other is None:
        return math.inf, np.full(2, math.inf)
    its = _pole_velocity(given, true, other)
    return abs(touch.time_s - other.time_s), np.abs(own - its) + led


def _same_touch(
    chain: RigidChain, start: ChainState, gap: Callable[[Array], float], touch: ChainState
) -> ChainState | None:
    """Where a flight comes to a touch; None where it does not, or to another one than `touch`."""
    end = touch.time_s + 0.5 * (touch.time_s - start.time_s)
    state_at, arrival = fly(chain, start, gap, end, TOLERANCE)
    if arrival is None:
        return None
    found = state_at(arrival)
    return None if np.abs(found.angles - touch.angles).max() > ANOTHER else found


def _unseen(
    given: Given, chain: RigidChain, flown: Descent, geometry: meshes.FingerGeometry, fall: float
) -> Unseen:
    """Of a flight; inf where phalanges that begin turned by the angle that they bend have no such
    touch.

    fall : speed at the touch, m/s
    """
    touch = flown.state_at(flown.touch_s)
    left = left_out(chain, flown, given.drive, geometry, given.materials)
    if given.settings.flight == "coarse":
        return Unseen(left.depth / fall, np.full(2, left.speed), left.speed)
    # against each other, which a whirl magnifies most
    turned = left.angle * (-1.0) ** np.arange(chain.links)
    bent = replace(flown.start, angles=flown.start.angles - turned)
    other = _same_touch(chain, bent, surface_gap(given.model, chain), touch)
    if other is None:
        return Unseen(math.inf, np.full(2, math.inf))
    changed = _pole_velocity(given, chain, touch) - _pole_velocity(given, chain, other)
    late = abs(touch.time_s - other.time_s) + left.depth / fall
    return Unseen(late, np.abs(changed) + left.speed, left.speed, left.settling)


def _pole_velocity(given: Given, chain: RigidChain, state: ChainState) -> Array:
    """(2,), m/s, of the tip's end on the rigid chain."""
    pole = np.array([given.model.pole])
    place = given.model.points[pole], given.model.body_of_point[pole]
    return pose(chain, state, *place)[1][0, :2]
