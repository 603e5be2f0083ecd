"""Estimated errors of a completed run's numbers, those of the first tap.

Errors of arrival and speed, and their effect on forces and times, come from `flight_error`. For the
tap a companion, a mesh of coarser or finer edges, taps from the run's own impact state
(`mesh_error`). Errors from motion that a flight omits and those of the mesh are independent: their
squares add up (JCGM 100, 5.1.2).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.cautions import SPIKE, flutter, imprecise, percent, spike, steps_per_cell_transit
from reference_fem.flight_error import (
    Flight,
    OmittedMotion,
    arrival_errors,
    omitted_motion,
    speed_exponent,
)
from reference_fem.mesh_error import (
    IMPULSE,
    PEAK,
    STRESS,
    CompanionRun,
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
# Relative error of the impulse by motion that a flight omits, above which a run is cautioned.
LARGEST_LEFT_OUT = 0.01
# Clearance at the companion's start, over the tip's radius: more than the height of any mesh's
# lowest nodes above the true round end.
CLEARANCE = 0.05


@dataclass(frozen=True)
class RunInputs:
    """The inputs of a run, and its rigid flight if it had one."""

    mesh: meshes.FingerMesh
    model: Model
    materials: Sequence[Material]
    drive: Drive
    settings: Settings
    start: ChainState | None
    flown: Descent | None

    @property
    def radius(self) -> float:
        """Radius of the touching end, m."""
        touching = self.model.body_of_point == self.model.touching_body
        return float(np.abs(self.model.points[touching, 1]).max())

    @property
    def section(self) -> float:
        """Length of the first shaft's cells over the diameter of the end that touches."""
        cells = np.asarray(self.mesh.cell_sets["phalanx_1"])
        lengths = np.ptp(self.mesh.points[self.mesh.cells[cells], 0], axis=1)
        return float(lengths.mean()) / (2.0 * self.radius)


def estimated(
    run: TapResult, inputs: RunInputs, companion: meshes.FingerMesh | None, again: Again
) -> TapResult:
    """A completed run with estimates of its errors, and a caution where one is large.

    again : solves the tap of another mesh from a rigid state.

    Raises KeyboardInterrupt: the companion was interrupted.
    """
    chain, first = chain_and_start(inputs.model.chain, inputs.start)
    gap = surface_gap(inputs.model, chain)
    flown = inputs.flown or descent(chain, gap, first, inputs.settings)
    speed = run.summary.tip_velocity_at_contact_m_per_s
    if run.summary.contact_time_s is None or speed is None or flown is None:
        return run
    if companion is None and not isinstance(inputs.settings.contact, str):
        return run  # a lumped law has no patch to resolve
    flight = Flight(chain, gap, inputs.model.points[[inputs.model.pole]], flown)
    touch = flight.touch
    angle, approach_speed = float(touch.angles[-1]), max(abs(speed[1]), 1e-300)
    resolution = Resolution(
        spacing(inputs.mesh, angle),
        hertz_radius(
            run.summary.peak_normal_force_N or 0.0, inputs.radius, inputs.materials[-1], angle,
            inputs.mesh.dim,
        ),
        inputs.section,
        inputs.mesh.dim,
    )  # fmt: skip
    errors: Errors = {"contact_time_s": math.inf, VELOCITY: (math.inf, math.inf)}
    late, of_speed, omitted, companion_run = math.inf, 0.0, OmittedMotion(0.0, np.zeros(2)), None
    of_mesh: dict[str, float] = {}
    of_ends: dict[str, float] = {}
    open_ends: tuple[str, ...] = ()
    if inputs.mesh.shape is not None:
        late, apart = arrival_errors(flight, *_true_body(inputs, inputs.mesh.shape))
        if inputs.settings.flight == "rigid":
            apart = apart + np.abs(flight.pole_velocity(touch) - speed)
        # where nodes lie is chance: a facet's middle is half a diagonal from the nearest
        sagitta = (inputs.mesh.dim - 1) * resolution.edge**2 / (8.0 * inputs.radius)
        sagitta_s = sagitta / approach_speed
        late = max(late, sagitta_s)
        sooner = flight.pole_velocity(flown.before(sagitta_s))
        apart = np.maximum(apart, np.abs(flight.pole_velocity(touch) - sooner))
        of_speed = float(max(apart)) / approach_speed
        if inputs.settings.flight != "explicit":
            omitted = omitted_motion(
                flight, inputs.settings.flight, inputs.drive, inputs.mesh.shape, inputs.materials,
                approach_speed,
            )  # fmt: skip
        errors["contact_time_s"] = late + omitted.late_s
        apart = apart + omitted.apart
        errors[VELOCITY] = float(apart[0]), float(apart[1])
        if companion is not None:
            tap = again(companion, flown.before(CLEARANCE * inputs.radius / approach_speed))
            if tap.status is Status.INTERRUPTED:
                raise KeyboardInterrupt
            own, its = inputs.model.symmetry_factor * len(inputs.model.cells), tap.summary.elements
            at_contact = spacing(companion, angle) / resolution.edge
            # the number of halved cells grows with the logarithm of their edges
            halved = inputs.mesh.ties.size > 0
            average = at_contact if halved else (own / its) ** (1.0 / inputs.mesh.dim)
            ratios = (at_contact, average)
            companion_run = CompanionRun(tap, ratios)
    if run.summary.contact_duration_s is not None:
        of_tap, of_left = tap_errors(run, companion_run, resolution), dict[str, float]()
        for name in of_tap:
            if value := abs(getattr(run.summary, name)):  # no friction: no tangential force at all
                of_tap[name] += of_speed * speed_exponent(name) * value
                of_left[name] = omitted.share(name, approach_speed) * value
        waves = 2.0 * inputs.materials[-1].density * inputs.materials[-1].bar_speed
        of_left[STRESS] = of_left.get(STRESS, 0.0) + waves * omitted.ringing_speed
        of_tap[PEAK] = max(of_tap[PEAK], standing_out(run, inputs.model))
        of_tap |= rivals(run, of_tap)
        if inputs.settings.tap_until_s == 0.0:
            of_ends, open_ends = other_ends(run, inputs.model)
        if max(of_speed, omitted.late_s) < math.inf:  # a companion's tap may end otherwise
            alone = tap_errors(run, None, resolution) if open_ends else of_tap
            of_mesh = {"contact_time_s": late, **alone}
        errors |= {
            name: math.hypot(max(error, of_ends.get(name, 0.0)), of_left.get(name, 0.0))
            for name, error in of_tap.items()
        }
    doubts = (*imprecise(run.summary, errors, of_mesh, resolution.edge_over_patch), *open_ends)
    # if there is another touch nothing is known of it, whatever the flight
    left = omitted.share(IMPULSE, approach_speed) if of_speed < math.inf else 0.0
    if of_speed == math.inf:
        doubts = (*doubts, ELSEWHERE)
    elif left > LARGEST_LEFT_OUT:
        share = percent(left) if left < math.inf else "an unknown share"
        # in a coarse flight the phase of the ringing is arbitrary
        rings = omitted.ringing_speed > LARGEST_LEFT_OUT * approach_speed
        how = "coarse" if rings else inputs.settings.flight
        doubts = (*doubts, RINGS.format(share, REMEDY[how]))
    doubts += flutter(
        run.forces, inputs.model.surface.friction, inputs.materials[-1], resolution.edge,
        resolution.patch,
    )  # fmt: skip
    if companion is None:
        doubts = (*doubts, ALONE)
    cautions = (*run.cautions, *doubts)
    return replace(run, errors=errors, mesh_errors=of_mesh, cautions=cautions)


def _true_body(
    inputs: RunInputs, geometry: meshes.FingerGeometry
) -> tuple[RigidChain, Callable[[Array], float]]:
    """The true body's chain and gap; with a lumped law the gap is that of the run's own point."""
    true = true_chain(geometry, inputs.materials, inputs.drive, inputs.mesh.dim)
    if isinstance(inputs.settings.contact, str):
        return true, true_gap(geometry, inputs.model.surface.height)
    return true, surface_gap(inputs.model, true)


def standing_out(run: TapResult, model: Model) -> float:
    """By how much an unresolved peak force (`cautions.SPIKE`) exceeds the forces beside it, N.

    A peak h above both sides has a `spike` of 2 h / 3 F.
    """
    start, lasts = run.summary.contact_time_s or 0.0, run.summary.contact_duration_s or 0.0
    normal = run.forces.normal_force_N[run.forces.time_s <= start + lasts]
    share = spike(normal, steps_per_cell_transit(model))
    return 1.5 * share * float(normal.max()) if share > SPIKE else 0.0
