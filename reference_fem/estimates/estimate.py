"""Estimated errors of a completed run's numbers, those of the first tap.

Errors of arrival and speed, and their effect on forces and times, come from `flight_error`. For the
tap a companion, a mesh of coarser or finer edges, taps from the run's own impact state
(`mesh_error`). Errors from motion that a flight omits and those of the mesh are independent: their
squares add up (JCGM 100, 5.1.2).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import meshes
from meshes.quality import volumes
from reference_fem.arrays import Array
from reference_fem.cautions import SPIKE, spike, steps_per_cell_transit
from reference_fem.contact.hertz import hertz_patch
from reference_fem.estimates.error_cautions import (
    flight_doubts,
    flutter,
    imprecise,
    later_taps,
    unlike_shape,
)
from reference_fem.estimates.flight_error import (
    NOTHING_OMITTED,
    WITHOUT_SHAPE,
    Flight,
    FlightErrors,
    arrival_errors,
    omitted_motion,
    speed_exponent,
)
from reference_fem.estimates.mesh_error import (
    PEAK,
    STRESS,
    TANGENTIAL,
    CompanionRun,
    Resolution,
    rivals,
    spacing,
    tap_errors,
)
from reference_fem.estimates.other_ends import other_ends
from reference_fem.flight.rigid_flight import Descent, descent, surface_gap
from reference_fem.model import Model
from reference_fem.results.result import Status, TapResult
from reference_fem.rigid.rigid_chain import ChainState, RigidChain, chain_and_start
from reference_fem.rigid.true_body import true_chain, true_gap
from reference_fem.scene import Scene

Errors = dict[str, float | tuple[float, float]]
Gap = Callable[[Array], float]  # m, at the phalanges' angles
Again = Callable[[meshes.FingerMesh, ChainState], TapResult | None]

VELOCITY = "tip_velocity_at_contact_m_per_s"

ALONE = "errors are estimated from this mesh's edges alone, for lack of a coarser one"
# Clearance at the companion's start, over the tip's radius: more than the height of any mesh's
# lowest nodes above the true round end.
CLEARANCE = 0.05


@dataclass(frozen=True)
class SolvedScene:
    """A solved scene: its model, and its rigid flight if it had one."""

    scene: Scene
    model: Model
    flown: Descent | None

    @property
    def radius(self) -> float:
        """Radius of the touching end, m."""
        return float(self.scene.mesh.radii[-1])

    def resolution(self, run: TapResult, angle: float) -> Resolution:
        """How finely the mesh resolves the patch; angle : of the last phalanx at the touch, rad."""
        mesh, peak = self.scene.mesh, run.summary.peak_normal_force_N or 0.0
        patch = hertz_patch(peak, self.radius, self.scene.materials[-1], angle, mesh.dim)
        own = section(mesh, self.model.kernel.cell_volume)
        return Resolution(spacing(mesh, angle), patch, own, mesh.dim)


def section(mesh: meshes.FingerMesh, volume: Array) -> float:
    """Largest mean length of a phalanx's cells along its axis over its diameter, the mean by their
    volume, (n_cells,).
    """
    lengths, shares = np.ptp(mesh.points[mesh.cells, 0], axis=1), []
    for w, radius in enumerate(mesh.radii.tolist()):
        own = mesh.cell_sets[f"phalanx_{w + 1}"]
        shares.append(float(np.average(lengths[own], weights=volume[own])) / (2.0 * radius))
    return max(shares)


class TapPart(NamedTuple):
    """Errors of the tap's numbers, those by the mesh alone, and cautions of its open ends."""

    errors: Mapping[str, float]
    of_mesh: Mapping[str, float]
    open_ends: tuple[str, ...]


def estimated(
    run: TapResult, solved: SolvedScene, companion: meshes.FingerMesh | None, again: Again
) -> TapResult:
    """A completed run with estimates of its errors, and a caution where one is large.

    again : solves the tap of another mesh from a rigid state; None: it cannot start there.

    Raises KeyboardInterrupt: the companion was interrupted.
    """
    scene = solved.scene
    chain, first = chain_and_start(solved.model.chain, scene.start)
    gap = surface_gap(solved.model, chain)
    flown = solved.flown or descent(chain, gap, first, scene.settings)
    velocity = run.summary.tip_velocity_at_contact_m_per_s
    if run.summary.contact_time_s is None or velocity is None or flown is None:
        return run
    if not isinstance(scene.settings.contact, str):
        return run  # a lumped law has no patch to resolve
    flight = Flight(chain, gap, solved.model.points[[solved.model.pole]], flown)
    angle, approach_speed = float(flight.touch.angles[-1]), max(abs(velocity[1]), 1e-300)
    resolution = solved.resolution(run, angle)
    of_flight, companion_run, unlike = WITHOUT_SHAPE, None, tuple[str, ...]()
    if scene.mesh.shape is not None:
        body = _true_body(solved, scene.mesh.shape)
        of_flight = _flight_errors(
            solved, scene.mesh.shape, body, flight, velocity, approach_speed, resolution
        )
        unlike = unlike_shape(solved.model.symmetry_factor * chain.inertia, body[0].inertia)
        if companion is not None:
            tap = again(companion, flown.before(CLEARANCE * solved.radius / approach_speed))
            ratio = spacing(companion, angle) / resolution.edge
            companion_run = None if tap is None else _companion_run(solved, tap, ratio)
    apart = of_flight.apart + of_flight.omitted.apart
    of_tap = TapPart({}, {}, ())
    if run.summary.contact_duration_s is not None:
        of_tap = _tap_part(run, solved, of_flight, companion_run, resolution, approach_speed)
    errors: Errors = {
        "contact_time_s": of_flight.late_s + of_flight.omitted.late_s,
        VELOCITY: (float(apart[0]), float(apart[1])),
        **of_tap.errors,
    }
    doubts = (
        *imprecise(run.summary, errors, of_tap.of_mesh, resolution.edge_over_patch),
        *of_tap.open_ends,
        *flight_doubts(of_flight, flight, scene.settings.flight, approach_speed, unlike),
        *flutter(
            run.forces, scene.surface.friction, scene.materials[-1], resolution.edge,
            resolution.patch,
        ),
        *later_taps(run.forces, run.summary.first_tap_end_s + 0.5 * run.summary.time_step_s),
        *(() if companion_run is not None else (ALONE,)),
    )  # fmt: skip
    cautions = (*run.cautions, *doubts)
    return replace(run, errors=errors, mesh_errors=of_tap.of_mesh, cautions=cautions)


def _flight_errors(
    solved: SolvedScene, shape: meshes.FingerGeometry, body: tuple[RigidChain, Gap],
    flight: Flight, velocity: tuple[float, float], approach_speed: float, resolution: Resolution,
) -> FlightErrors:  # fmt: skip
    """Compare the run's flight with the true body's, and add the motion that it omits."""
    scene, touch = solved.scene, flight.touch
    late, apart = arrival_errors(flight, *body)
    if scene.settings.flight == "rigid":
        apart = apart + np.abs(flight.pole_velocity(touch) - velocity)
    # where nodes lie is chance: a facet's middle is half a diagonal from the nearest
    sagitta = (scene.mesh.dim - 1) * resolution.edge**2 / (8.0 * solved.radius)
    sagitta_s = sagitta / approach_speed
    sooner = flight.pole_velocity(flight.flown.before(sagitta_s))
    apart = np.maximum(apart, np.abs(flight.pole_velocity(touch) - sooner))
    of_speed = float(max(apart)) / approach_speed
    omitted = NOTHING_OMITTED
    if scene.settings.flight_error:
        light, flying = scene.flight_mesh, resolution.section
        if light is not None:
            flying = section(light, volumes(light.points, light.cells))
        omitted = omitted_motion(
            flight, scene.settings.flight, scene.drive, shape, scene.materials, approach_speed,
            flying,
        )  # fmt: skip
    return FlightErrors(max(late, sagitta_s), apart, of_speed, omitted)


def _companion_run(solved: SolvedScene, tap: TapResult, at_contact: float) -> CompanionRun:
    """A companion's tap with its edges over the run's, `at_contact` and on average.

    Raises KeyboardInterrupt: it was interrupted.
    """
    if tap.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    mesh = solved.scene.mesh
    own, its = solved.model.symmetry_factor * len(solved.model.cells), tap.summary.elements
    # the number of halved cells grows with the logarithm of their edges
    halved = mesh.ties.size > 0
    average = at_contact if halved else (own / its) ** (1.0 / mesh.dim)
    return CompanionRun(tap, (at_contact, average))


def _tap_part(
    run: TapResult, solved: SolvedScene, flight: FlightErrors, companion_run: CompanionRun | None,
    resolution: Resolution, approach_speed: float,
) -> TapPart:  # fmt: skip
    """Errors of a tap that ended, by its mesh, its flight and its open ends."""
    scene, material, omitted = solved.scene, solved.scene.materials[-1], flight.omitted
    of_tap, of_left = tap_errors(run, companion_run, resolution), dict[str, float]()
    for name in of_tap:
        if value := abs(getattr(run.summary, name)):  # no friction: no tangential force at all
            of_tap[name] += flight.of_speed * speed_exponent(name) * value
            of_left[name] = omitted.share(name, approach_speed) * value
    waves = 2.0 * material.density * material.bar_speed
    of_left[STRESS] = of_left.get(STRESS, 0.0) + waves * omitted.ringing_speed
    for name, excess in standing_out(run, solved.model).items():
        of_tap[name] = max(of_tap[name], excess)
    of_tap |= rivals(run, of_tap)
    of_ends, open_ends = dict[str, float](), tuple[str, ...]()
    if scene.settings.tap_until_s == 0.0:
        of_ends, open_ends = other_ends(run, solved.model)
    of_mesh: dict[str, float] = {}
    if max(flight.of_speed, omitted.late_s) < math.inf:
        # a companion's tap may end otherwise
        alone = tap_errors(run, None, resolution) if open_ends else of_tap
        of_mesh = {"contact_time_s": flight.late_s, **alone}
    errors = {
        name: math.hypot(max(error, of_ends.get(name, 0.0)), of_left.get(name, 0.0))
        for name, error in of_tap.items()
    }
    return TapPart(errors, of_mesh, open_ends)


def _true_body(solved: SolvedScene, geometry: meshes.FingerGeometry) -> tuple[RigidChain, Gap]:
    """The true body's chain and gap; with a lumped law the gap is that of the run's own point."""
    true = true_chain(geometry, solved.scene.materials, solved.scene.drive, solved.scene.mesh.dim)
    if isinstance(solved.scene.settings.contact, str):
        return true, true_gap(geometry, solved.model.surface.height)
    return true, surface_gap(solved.model, true)


def standing_out(run: TapResult, model: Model) -> dict[str, float]:
    """By how much unresolved peaks (`cautions.SPIKE`) exceed the forces beside them, N.

    A peak h above both sides has a `spike` of 2 h / 3 F.
    """
    forces, found = run.forces.until(run.summary.first_tap_end_s), {}
    of = {PEAK: forces.normal_force_N, TANGENTIAL: np.abs(forces.tangential_force_N)}
    for name, force in of.items():
        share = spike(force, steps_per_cell_transit(model))
        found[name] = 1.5 * share * float(force.max()) if share > SPIKE else 0.0
    return found
