"""Friction loss, rows and frames of a step: of collocation, from its stages.

The loss of a sliding tip is a quadrature of F_t V_P, of the stages' order. A long step's places lie
on the stages' polynomial; a cubic through its ends is off by 1 % of a tap's bending.
"""

from hcm.arrays import Floats
from hcm.assembly.equations import depends_on_velocity, dissipated_power
from hcm.assembly.state import Motion, RunTotals, advance_totals
from hcm.beam.probe import Probe
from hcm.compiled import by_type, kernel
from hcm.contact.contract import (
    contact_force,
    contact_position,
    contact_velocity,
    friction_loss,
    has_rate_force,
    particle_position,
    particle_velocity,
    rate_force,
    tip_force,
)
from hcm.contact.law import FLIGHT, SLIP, ContactState
from hcm.integrators.gauss_tableau import GaussIntegrator
from hcm.integrators.stages import lagrange, stage_motion
from hcm.integrators.step import AnyIntegrator, collocated
from hcm.results.record import FrameTable, frames_inside, hermite, write_row


@kernel
def friction_power(motion: Motion, contact: ContactState, integrator: GaussIntegrator) -> float:
    """Power lost to friction, -F_t V_P, W."""
    tip, law = integrator.chain.tip, integrator.law
    _, gap = contact_position(motion.q, tip, contact, law)
    vt, vn = contact_velocity(motion.q, motion.v, tip, contact, law)
    ft, _ = tip_force(motion.q, motion.v, tip, contact, law)
    return -ft * particle_velocity(gap, vt, vn, contact, law)


@kernel
def plain_friction(
    loss: float, h: float, old: Motion, new: Motion, contact: ContactState,
    integrator: AnyIntegrator,
) -> float:  # fmt: skip
    """`loss` plus that of the step, J, by the law's `friction_loss`."""
    tip, law = integrator.chain.tip, integrator.law
    x0, y0 = contact_position(old.q, tip, contact, law)
    x1, y1 = contact_position(new.q, tip, contact, law)
    loss = friction_loss(loss, x0, y0, x1, y1, contact, law)
    if has_rate_force(law) and contact.tangential_mode == SLIP:
        ft0, fn0 = contact_force(x0, y0, contact, law)
        ft1, fn1 = contact_force(x1, y1, contact, law)
        more, _ = rate_force(y0, ft0, fn0, old.q, old.v, tip, contact, law)
        more += rate_force(y1, ft1, fn1, new.q, new.v, tip, contact, law)[0]
        slid = particle_position(x1, y1, contact, law) - particle_position(x0, y0, contact, law)
        loss -= 0.5 * more * slid
    return loss


@kernel
def stage_friction(
    loss: float, h: float, old: Motion, new: Motion, contact: ContactState,
    integrator: GaussIntegrator,
) -> float:  # fmt: skip
    """`plain_friction`, or a quadrature over the stages if the tip slides."""
    if not integrator.contact or contact.tangential_mode != SLIP:
        return plain_friction(loss, h, old, new, contact, integrator)
    for i in range(integrator.tableau.b.size):
        stage = stage_motion(i, old, integrator)
        loss += h * integrator.tableau.b[i] * friction_power(stage, contact, integrator)
    return loss


@kernel
def write_stages(
    h: float, contact: ContactState, totals: RunTotals, old: Motion, integrator: GaussIntegrator,
    probe: Probe, rows: Floats, reactions: Floats,
) -> int:  # fmt: skip
    """Write a row for each stage of an accepted step in contact; returns how many."""
    chain, law, table = integrator.chain, integrator.law, integrator.tableau
    if contact.normal_mode == FLIGHT or not integrator.contact:
        return 0
    slides, gauss = contact.tangential_mode == SLIP, integrator.gauss
    power = gauss.change
    for j in range(table.c.size):
        stage = stage_motion(j, old, integrator)
        power[0, j] = friction_power(stage, contact, integrator) if slides else 0.0
        power[1, j] = 0.0
        if depends_on_velocity(chain, law):
            power[1, j] = dissipated_power(stage.q, stage.chords, stage.v, chain, contact, law)
    for i in range(table.c.size):
        stage = stage_motion(i, old, integrator)
        friction, lost = totals.friction_loss, 0.0
        if not slides:
            friction = plain_friction(friction, h, old, stage, contact, integrator)
        for j in range(table.c.size):
            friction += h * table.a[i, j] * power[0, j]
            lost += h * table.a[i, j] * power[1, j]
        at = advance_totals(totals, table.c[i] * h, friction, lost, old, stage, chain, contact, law)
        write_row(rows[i], reactions[i], stage, at, contact, integrator, probe)
    return int(table.c.size)


@kernel
def plain_frames(
    h: float, contact: ContactState, totals: RunTotals, old: Motion, new: Motion,
    integrator: AnyIntegrator, frames: FrameTable,
) -> None:  # fmt: skip
    """Interpolate q (cubic Hermite in q and v) at the wanted times inside an accepted step."""
    first, end = frames_inside(totals, h, frames)
    for m in range(first, end):
        s = min((frames.time[m] - totals.time) / h, 1.0)
        for i in range(old.q.size):
            frames.q[m, i] = hermite(s, h, old.q[i], old.v[i], new.q[i], new.v[i])


@kernel
def stage_frames(
    h: float, contact: ContactState, totals: RunTotals, old: Motion, new: Motion,
    integrator: GaussIntegrator, frames: FrameTable,
) -> None:  # fmt: skip
    """`plain_frames`; by collocation q(s h) = q_0 + s h v_0 + h^2 sum_k l_k(s) (s/c_k) B_k."""
    if not collocated(contact, integrator):
        plain_frames(h, contact, totals, old, new, integrator, frames)
        return
    first, end = frames_inside(totals, h, frames)
    c, unknown = integrator.tableau.c, integrator.gauss.unknown
    for m in range(first, end):
        s = min((frames.time[m] - totals.time) / h, 1.0)
        for i in range(old.q.size):
            frames.q[m, i] = old.q[i] + s * h * old.v[i]
        for k in range(c.size):
            weight = h * h * lagrange(k, s, c) * s / c[k]
            for i in range(old.q.size):
                frames.q[m, i] += weight * unknown[k, i]


@kernel
def stage_rows(integrator: GaussIntegrator) -> int:
    """Most rows of a step: one, plus one per stage if collocation takes steps in contact."""
    return integrator.tableau.c.size + 1 if integrator.contact else 1


friction_of_step = by_type(GaussIntegrator, stage_friction, plain_friction)
write_between = by_type(GaussIntegrator, write_stages, 0)
fill_frames = by_type(GaussIntegrator, stage_frames, plain_frames)
rows_of_step = by_type(GaussIntegrator, stage_rows, 1)
