"""A scene and its settings in the form the compiled loop takes: arrays, named tuples, the start.

A run starts at rest along -X or in a rigid state of straight, unstrained phalanges. Phalanx w,
turned by theta_w from -X, has the tangent t = (-cos theta, -sin theta) and, turning at omega_w, the
nodes

    r(s) = r_w + s t,     r' = t,     v(s) = v_w + s omega n,     v' = omega n,
    n = e_z x t = (sin theta, -cos theta),

r_w and v_w being those of the previous phalanx's end: hinges hold in position and velocity.
"""

import math
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import numpy as np

from hcm.arrays import Floats
from hcm.assembly.state import StepLimits
from hcm.assumptions import PAPER, Assumptions
from hcm.beam.chain import Chain, build_chain
from hcm.beam.customized_mass import customized
from hcm.beam.drive import Piece, torques_on_nodes
from hcm.beam.outline import Outline, build_outline, depth_by_kind
from hcm.beam.probe import Probe, build_probe, smooth_probe
from hcm.beam.refinement import beams_of, refine_chain, shear_number, touching_height
from hcm.bounds import Bound, check_fields
from hcm.compiled import entry
from hcm.contact.build import law_of
from hcm.integrators.gauss_tableau import with_collocation
from hcm.integrators.step import AnyIntegrator
from hcm.integrators.workspace import Integrator, coefficients, workspace
from hcm.parameters import GAUSS, Drive, Finger, ParameterError, Settings, Surface, Tip
from hcm.results.record import FrameTable
from hcm.taps.tap import TapEndRule, tap_ends


@dataclass(frozen=True)
class RigidStart:
    """A rigid state of the finger."""

    angles: Annotated[tuple[float, ...], Bound("rad")]
    """theta_w, counter-clockwise from the rest along -X, one per phalanx."""
    rates: Annotated[tuple[float, ...], Bound("rad/s")]
    """omega_w, absolute, one per phalanx."""
    time_s: Annotated[float, Bound("s", at_least=0, at_most=1e5)] = 0.0
    """Time of that state; beyond a day the times of a tap's steps lose their digits."""

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Scene:
    """A finger, what it touches and how, and how that is solved: what `simulate_scene` takes."""

    finger: Finger
    surface: Surface
    tip: Tip
    drive: Drive = field(default_factory=Drive)
    settings: Settings = field(default_factory=Settings)
    start: RigidStart | None = None
    assumptions: Assumptions = PAPER

    def __post_init__(self) -> None:
        check_fields(self)
        if self.tip.normal_stiffness is None and self.assumptions.needs_stiffness:
            raise ParameterError(
                "tip.normal_stiffness is missing: must be a finite number in N/m, > 0, unless"
                " partial_slip is assumed"
            )


def check_scene(finger: Finger, surface: Surface, drive: Drive) -> None:
    """Check what no single object can: parts that must fit each other.

    Raises ParameterError: the number of torques is not the number of phalanges, or the surface is
        out of reach.
    """
    rows = (drive.torques,) if drive.table is None else drive.table.values
    for row in rows:
        if len(row) != len(finger.phalanges) and (row or drive.table is not None):
            none = ", or none" if drive.table is None else ""
            raise ParameterError(
                f"torques has {len(row)} values: must be one per phalanx"
                f" ({len(finger.phalanges)}){none}"
            )
    if surface.height >= finger.length:
        raise ParameterError(
            f"height = {surface.height!r}: must be below the finger's length {finger.length:g} m,"
            " or the tip never reaches the surface"
        )


def rods_state(finger: Finger, start: RigidStart | None) -> tuple[Floats, float]:
    """Angles and rates (2 P,) that a run starts with, and their time, s.

    Raises ParameterError: there is not one angle and one rate per phalanx.
    """
    count = len(finger.phalanges)
    if start is None:
        return np.zeros(2 * count), 0.0
    if len(start.angles) != count or len(start.rates) != count:
        raise ParameterError(
            f"start has {len(start.angles)} angles and {len(start.rates)} rates:"
            f" must be one of each per phalanx ({count})"
        )
    return np.array([*start.angles, *start.rates], dtype=float), float(start.time_s)


def rigid_motion(finger: Finger, chain: Chain, start: RigidStart) -> tuple[Floats, Floats]:
    """Bordered coordinates q and velocities v (n,) of a rigid state."""
    state = rods_state(finger, start)[0]
    q, v = np.zeros(chain.weight.size), np.zeros(chain.weight.size)
    lengths = np.array([p.length for p in finger.phalanges])
    fill_rigid_motion(state, lengths, chain, q, v)
    return q, v


@entry
def fill_rigid_motion(state: Floats, lengths: Floats, chain: Chain, q: Floats, v: Floats) -> None:
    """Write the nodes of rigid phalanges, theta and theta. in `state` (2 P,), to q and v (n,).

    lengths : (P,) of the phalanges, m.
    """
    x, y, vx, vy, links = 0.0, 0.0, 0.0, 0.0, lengths.size
    for w in range(links):
        tx, ty = -math.cos(state[w]), -math.sin(state[w])
        nx, ny = -state[links + w] * ty, state[links + w] * tx
        first = chain.hinge_outer[w]
        last = chain.hinge_inner[w + 1] if w + 1 < links else chain.tip
        for node in range(first, last + 1, 4):
            s = lengths[w] * (node - first) / max(last - first, 1)
            q[node], q[node + 1], q[node + 2], q[node + 3] = x + s * tx, y + s * ty, tx, ty
            v[node], v[node + 1], v[node + 2], v[node + 3] = vx + s * nx, vy + s * ny, nx, ny
        x, y, vx, vy = q[last], q[last + 1], v[last], v[last + 1]


class Model(NamedTuple):
    """All that a run computes with.

    generalized_alpha : the integrator without collocation. drive : torques on the chain's nodes.
    start_s, q, v : time, bordered coordinates and velocities (n,) at the start. angles : (2 P,)
    theta and theta. there. outline : parts of the finger that may not touch. roundoff_J : energy a
    finger at rest gains by round-off. tap_ends : the rule; None if each separation ends a tap.
    """

    settings: Settings
    chain: Chain
    probe: Probe
    outline: Outline
    drive: tuple[Piece, ...]
    generalized_alpha: Integrator
    limits: StepLimits
    frames: FrameTable
    start_s: float
    q: Floats
    v: Floats
    angles: Floats
    roundoff_J: float
    tap_ends: TapEndRule | None

    def integrator(self) -> AnyIntegrator:
        """The run's integrator: `generalized_alpha`, with collocation if the settings want it."""
        plain, of = self.generalized_alpha, self.settings
        gauss = [of.flight_integrator == GAUSS, of.contact_integrator == GAUSS]
        return with_collocation(plain, of.stages, *gauss) if any(gauss) else plain


def build_model(scene: Scene) -> Model:
    """Assemble what a run computes with.

    Raises ParameterError: the start does not fit the finger, or puts it below the surface.
    """
    whole, surface, assumptions = scene.finger, scene.surface, scene.assumptions
    drive, settings, start = scene.drive, scene.settings, scene.start
    finger = beams_of(whole, assumptions)
    chain, q = build_chain(finger, drive)
    last, height = whole.phalanges[-1], touching_height(whole, surface, assumptions)
    if assumptions.any:
        chain = refine_chain(chain, whole, drive, assumptions)
        rigidity = 1 / (1 + shear_number(finger.phalanges[-1], assumptions))
        probe = smooth_probe(finger, last.length, rigidity, assumptions.has("cauchy_stress"))
    else:
        probe = build_probe(finger)
    v, (angles, start_s) = np.zeros(q.size), rods_state(finger, start)
    if start is not None:
        q, v = rigid_motion(finger, chain, start)
        if (clearance := float(q[chain.tip + 1]) + height) <= 0:
            raise ParameterError(
                f"start.angles = {start.angles!r}: put the tip {abs(clearance):.3g} m below the"
                " surface; it must start above it"
            )
    tip_radius = last.diameter / 2 if assumptions.has("lowest_point") else 0.0
    outline = build_outline(finger, surface.height, tip_radius)
    if (cut := depth_by_kind(None, q, chain, outline)[0]) > 0:
        raise ParameterError(
            f"height = {surface.height!r}: the surface cuts {cut:.3g} m into the finger at the"
            " start; it must lie below it"
        )
    co = coefficients(settings.spectral_radius, settings.newton_tolerance, settings.reuse_factors)
    plain = Integrator(co, chain, law_of(whole, surface, scene.tip, assumptions), workspace(q.size))
    times = np.array(settings.frame_times, dtype=float)
    frames = FrameTable(times, np.empty((times.size, q.size)))
    if times.size:
        frames.q[:] = np.nan
        frames.q[times == start_s] = q
    return Model(
        settings=settings,
        chain=chain,
        probe=probe,
        outline=outline,
        drive=torques_on_nodes(drive, len(finger.phalanges)),
        generalized_alpha=plain,
        limits=limits_of(settings, surface.height),
        frames=frames,
        start_s=start_s,
        q=q,
        v=v,
        angles=angles,
        # measured up to 1e-20 of E A L at 40 elements of E = 1e12 Pa and 3000 steps; a light finger
        # in very weak gravity moves with 1e-12
        roundoff_J=1e-16 * sum(p.youngs_modulus * p.area * p.length for p in finger.phalanges),
        tap_ends=tap_ends(whole, assumptions, settings.tap_until),
    )


def until_touch(model: Model, finger: Finger, assumptions: Assumptions) -> Model:
    """The finger's model with customized masses, for a run that ends with its first touch."""
    chain = customized(model.chain, finger, assumptions)
    return model._replace(
        chain=chain,
        generalized_alpha=model.generalized_alpha._replace(chain=chain),
        limits=model.limits._replace(taps=0),
        tap_ends=None,
    )


def limits_of(settings: Settings, height: float) -> StepLimits:
    """Convert the settings for the compiled loop; height : depth of the surface, m."""
    endless = settings.end_time is not None
    return StepLimits(
        float(settings.flight_step),
        float(settings.contact_step),
        np.iinfo(np.int64).max if endless else settings.taps,
        float(settings.end_time) if settings.end_time is not None else math.inf,
        settings.flight_tolerance * height,
        float(settings.contact_tolerance),
        math.inf if endless else float(settings.max_flight_time),
        float(settings.max_contact_time),
        undamped=settings.flight_tolerance > 0.0 and settings.flight_integrator != GAUSS,
    )
