"""A tap of the solid finger with the lumped contact law on one point of it.

The second rung of the validation ladder (design.md section 7): both models have the same contact,
at the flat end's middle where the reduced model has its tip node, so that what separates them is
beams against solids. On the hemispherical end the same law acts at the sphere's lowest point: what
that changes is the share of the tip's geometry.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import meshes
from reference_fem.contact.lumped import (
    ENERGIES,
    FRICTION_LOSS,
    HYSTERESIS_LOSS,
    MEMORY,
    STORED,
    LumpedContact,
    lumped_force,
)
from reference_fem.contact.lumped_point import LumpedPoint, lumped_point
from reference_fem.contact.lumped_result import (
    LumpedAudit,
    LumpedHistory,
    LumpedTapResult,
    summarize_lumped,
)
from reference_fem.dynamics.central_difference import half_kick, leapfrog
from reference_fem.dynamics.step import less_reactions
from reference_fem.model import Model, build_model
from reference_fem.rigid_chain import ChainState, RigidChain, chain_and_start, fly, pose
from reference_fem.settings import Drive, Material, Settings, Surface
from reference_fem.status import Status

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

# Audits in the time that an axial wave takes along the last phalanx.
AUDITS_PER_TRANSIT = 20
# The penalty's springs take no part here: too soft to enter the stable step.
NO_PENALTY = 1e-12
COLUMNS = 10


def simulate_lumped(
    mesh: meshes.FingerMesh,
    materials: Sequence[Material],
    surface: Surface,
    drive: Drive,
    contact: LumpedContact,
    settings: Settings | None = None,
    progress: Progress | None = None,
    start: ChainState | None = None,
) -> LumpedTapResult:
    """Let the finger of `mesh` fall and touch by the lumped law. One tap.

    Parameters
    ----------
    mesh
        With a flat or a hemispherical end (see `lumped_point`).
    materials, surface, drive, progress, start
        As for `simulate.simulate`.
    contact
        The law's constants; friction is the surface's.
    settings
        Its step_factor, threads, element, lead_steps, energy_tolerance and the longest times are
        used; the flight is rigid and the penalty has no part.

    Raises
    ------
    ValueError
        For bad input, naming it, its value and what is allowed.
    """
    started = time.perf_counter()
    settings = replace(settings or Settings(), contact="penalty", penalty_factor=NO_PENALTY)
    model = build_model(mesh, materials, surface, drive, settings)
    point = lumped_point(mesh, model.mass)
    model = replace(model, step_s=coupled_step(model, point, contact, settings.step_factor))
    chain, begin = chain_and_start(model.chain, start)
    gap = _gap(model, point, chain)
    if (clearance := gap(begin.angles)) <= 0.0:
        raise ValueError(
            f"height = {surface.height}: the tip starts {-clearance:.3g} m below the "
            "surface; it must start above it"
        )
    if progress is not None:
        progress(0.0, "rigid flight")
    last = begin.time_s + min(settings.max_flight_time_s, settings.end_time_s or np.inf)
    state_at, touch = fly(chain, begin, gap, last)
    if touch is None:
        missed = Status.NOT_REACHED
        message = f"the surface is not reached within {last:.6g} s: {missed.advice}"
        return _result(model, [], [], missed, message, False, started)
    landed = state_at(max(begin.time_s, touch - settings.lead_steps * model.step_s))
    return _run(model, point, contact, settings, landed, progress, started)


def coupled_step(model: Model, point: LumpedPoint, contact: LumpedContact, factor: float) -> float:
    """Δt = factor 2/ω, ω² = ω_e² + k_max/(copies m) (1 + m R²/J), s.

    The law's springs act on the mean: K_c = k w wᵀ, whose largest eigenvalue in M⁻¹K_c is
    k Σ w_i²/m_i = k/m for mass weights, m = Σ m_i (see `stable_step.frequency_bound`); a rolling
    sphere's tangential spring turns the section, of inertia J, as well.
    """
    elastic = 2.0 * factor / model.step_s
    section = point.section
    mass = model.copies * float(section.masses.sum())
    inertia = model.copies * float(section.masses @ (section.arms**2).sum(axis=1))
    spring = contact.stiffest * (1.0 / mass + point.radius**2 / inertia)
    return 2.0 * factor / float(np.hypot(elastic, np.sqrt(spring)))


def _gap(model: Model, point: LumpedPoint, chain: RigidChain) -> Callable[[Array], float]:
    nodes = point.nodes
    points, bodies = model.points[nodes], model.body_of_point[nodes]

    def gap(angles: Array) -> float:
        still = ChainState(angles, np.zeros_like(angles), 0.0)
        displacement, _ = pose(chain, still, points, bodies)
        middle = float(point.weights @ (points[:, 1] + displacement[:, 1]))
        return middle - point.radius + model.surface.height

    return gap


def _run(
    model: Model,
    point: LumpedPoint,
    contact: LumpedContact,
    settings: Settings,
    landed: ChainState,
    progress: Progress | None,
    started: float,
) -> LumpedTapResult:
    """The explicit loop, up to the end of the contact."""
    assert model.chain is not None
    u, v = pose(model.chain, landed, model.points, model.body_of_point)
    residual, middle = np.empty_like(u), np.empty_like(u)
    memory, energies = np.zeros(MEMORY), np.zeros(ENERGIES)
    angles = [c.angle(u, landed.angles[c.phalanx]) for c in model.couples]
    interval = max(1, round(model.transit_s / (AUDITS_PER_TRANSIT * model.step_s)))
    turn = float(landed.angles[-1])
    turning = float(landed.rates[-1])
    rows: list[Array] = []
    audits: list[Array] = []
    height, friction_ratio = model.surface.height, model.surface.friction
    friction = hysteresis = largest = 0.0
    touch_s: float | None = None
    status, message, finished = Status.INTERRUPTED, "", False
    _forces(model, u, v, residual)
    half_kick(v, residual, model.inverse_mass, model.gravity, -model.step_s, middle)
    v = middle.copy()
    try:
        while True:
            now = landed.time_s + len(rows) * model.step_s
            _forces(model, u, v, residual)
            x, y, turned = point.position(u, turn)
            if rows:
                turning = (turned - turn) / model.step_s
            turn = turned
            vx, vy = point.velocity(v, turning)
            tangential, normal = lumped_force(
                x, y + height, vx, vy, *contact.constants, friction_ratio, memory, energies
            )
            point.load(tangential / model.copies, normal / model.copies, u, residual)
            friction += energies[FRICTION_LOSS]
            hysteresis += energies[HYSTERESIS_LOSS]
            stored = energies[STORED]
            rows.append(
                np.array([now, normal, tangential, x, y, vx, vy, stored, friction, hysteresis])
            )
            if touch_s is None and normal > 0.0:
                touch_s = now
            finished = touch_s is not None and normal == 0.0
            if (len(rows) - 1) % interval == 0 or finished:
                half_kick(v, residual, model.inverse_mass, model.gravity, model.step_s, middle)
                angles = [c.angle(u, a) for c, a in zip(model.couples, angles, strict=True)]
                audits.append(_audit(model, u, middle, now, angles, rows[-1]))
                error, kinetic = audits[-1][-1] - audits[0][-1], audits[-1][1]
                largest = max(largest, kinetic)
                if not abs(error) <= settings.energy_tolerance * largest:
                    lost = Status.UNSTABLE
                    text = f"the energy balance is off by {error:.3g} J at step {len(rows)}"
                    audits.pop()
                    status, message = lost, f"{text}, t = {now:.6g} s: {lost.advice}"
                    break
                if progress is not None:
                    share = 0.0 if touch_s is None else (now - touch_s) / (8.0 * model.transit_s)
                    progress(min(0.99, share), "contact")
            if finished:
                status = Status.COMPLETED
                break
            if now - (touch_s or landed.time_s) > settings.max_contact_time_s:
                status = Status.NOT_REACHED if touch_s is None else Status.STILL_IN_CONTACT
                message = f"at t = {now:.6g} s: {status.advice}"
                break
            leapfrog(u, v, residual, model.inverse_mass, model.gravity, model.step_s)
    except KeyboardInterrupt:
        message = f"interrupted at step {len(rows)}: {status.advice}"
    return _result(model, rows, audits, status, message, finished, started)


def _forces(model: Model, u: Array, v: Array, residual: Array) -> None:
    """Internal force less couples and hinge reactions.

    The contact's force can follow: its nodes hold no hinge, whose reactions depend on the forces
    on their own nodes alone.
    """
    model.kernel.internal_force(u, residual)
    for couple in model.couples:
        couple.apply(u, residual)
    residual[model.symmetry, 2:] = 0.0
    less_reactions(model, u, v, residual)


def _audit(model: Model, u: Array, v: Array, now: float, angles: list[float], row: Array) -> Array:
    """Time, kinetic, strain and gravity energy, drive work, stress at R, and the sum of all."""
    with np.errstate(all="ignore"):
        kinetic = 0.5 * model.copies * float(model.mass @ (v * v).sum(axis=1))
        strain = model.copies * model.kernel.strain_energy(u)
        gravity = model.copies * model.gravity * float(model.mass @ u[:, 1])
        work = model.copies * sum(
            c.torque * angle for c, angle in zip(model.couples, angles, strict=True)
        )
        stress = model.probe.read(model.kernel, u)
    total = kinetic + strain + gravity - work + row[7:].sum()
    return np.array([now, kinetic, strain, gravity, work, stress, total])


def _result(
    model: Model,
    rows: list[Array],
    audits: list[Array],
    status: Status,
    message: str,
    finished: bool,
    started: float,
) -> LumpedTapResult:
    table = np.array(rows).reshape(-1, COLUMNS)
    history = LumpedHistory(
        table[:, 0], table[:, 1], table[:, 2], table[:, 3:5], table[:, 5:7],
        table[:, 7], table[:, 8], table[:, 9],
    )  # fmt: skip
    columns = np.array(audits).reshape(-1, 7).T.copy()
    columns[-1] -= columns[-1, :1].sum()
    audit = LumpedAudit(*columns)
    summary = summarize_lumped(
        history,
        audit,
        finished,
        wall_time_s=time.perf_counter() - started,
        steps=len(rows),
        elements=model.copies * len(model.cells),
        time_step_s=model.step_s,
    )
    return LumpedTapResult(status, message, history, audit, summary)
