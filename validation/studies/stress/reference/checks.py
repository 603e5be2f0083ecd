"""Invariants of a run of the reference, from its results and its fields.

Energies are summed here over the fields that the run kept, by masses and stored strains alone;
contact is judged from the record of every step, momentum from both (`momentum`).
"""

from collections.abc import Iterator

import numpy as np

from reference_fem import Snapshot, Status, TapResult
from reference_fem.model import Model
from validation.studies.stress.judging import not_finite
from validation.studies.stress.reference.momentum import momentum

# Largest imbalance of a COMPLETED run's energy, over its largest kinetic energy: what it promises
# (`Settings.energy_tolerance`).
ENERGY_BOUND = 0.1
# Round-off of sums over some hundred nodes and some thousand steps.
ROUND_OFF = 1e-9


def violations(result: TapResult, model: Model) -> list[str]:
    """What is wrong with a run, one sentence each; empty when all invariants hold."""
    found = list(not_finite((result.history, result.forces, result.summary, *result.snapshots)))
    if found:
        return found
    found = [*_ending(result), *_contact(result, model), *momentum(result, model)]
    if result.status is Status.COMPLETED:
        found += [*_energy(result, model), *_below(result, model)]
    return found


def _ending(result: TapResult) -> Iterator[str]:
    if result.status is not Status.COMPLETED and not result.status.advice:
        yield f"{result.status.name} without advice"
    if not result.message:
        yield f"{result.status.name} without a message"
    if not len(result.history.time_s):
        yield f"{result.status.name} and nothing is kept"


def _contact(result: TapResult, model: Model) -> Iterator[str]:
    """Fn >= 0 and |Ft| <= mu Fn in every step, no force above the surface, slip takes energy."""
    f, h = result.forces, result.history
    peak = float(f.normal_force_N.max(initial=0.0))
    if f.normal_force_N.min(initial=0.0) < 0.0:
        yield f"the surface pulls with {-f.normal_force_N.min():.3g} N"
    excess = np.abs(f.tangential_force_N) - model.surface.friction * f.normal_force_N
    if max(excess.max(initial=0.0), h.coulomb_excess_N.max(initial=0.0)) > ROUND_OFF * peak:
        yield f"tangential force leaves the cone by {excess.max():.3g} N (peak Fn {peak:.3g} N)"
    kinetic = float(h.kinetic_energy_J.max(initial=0.0))
    for name in ("friction_dissipation_J", "contact_damping_J", "material_dissipation_J"):
        drop = -np.diff(getattr(h, name)).min(initial=0.0)
        if drop > ROUND_OFF * kinetic:
            yield f"{name} falls by {drop:.3g} J (kinetic {kinetic:.3g} J)"
    for name in ("strain_energy_J", "contact_energy_J", "hourglass_energy_J"):
        if getattr(h, name).min(initial=0.0) < -ROUND_OFF * kinetic:
            yield f"{name} is negative"


def _below(result: TapResult, model: Model) -> Iterator[str]:
    """No node of the body lies below those that the surface can push."""
    others = np.setdiff1d(np.arange(len(model.points)), model.contact.nodes)
    for shown in result.snapshots:
        height = model.points[:, 1] + shown.displacement[:, 1] + model.surface.height
        depth = min(0.0, height[model.contact.nodes].min()) - height[others].min()
        if depth > ROUND_OFF * np.ptp(model.points, axis=0).max():
            yield f"{depth:.3g} m of the body lie below its contact at {shown.time_s:.6g} s"
            return


def body_energy(snapshot: Snapshot, model: Model) -> tuple[float, float]:
    """Kinetic energy, and the body's total energy without the contact's springs, J."""
    u, v = snapshot.displacement, snapshot.velocity
    kinetic = 0.5 * float(model.mass @ (v * v).sum(axis=1)) * model.symmetry_factor
    stored = (
        model.kernel.energies(u)[0] - float(model.mass @ (u[:, :2] @ model.gravity_vector))
    ) * model.symmetry_factor
    return kinetic, kinetic + stored


def _energy(result: TapResult, model: Model) -> Iterator[str]:
    """Energy balances from before to after the tap, without loaded springs, and in the audit."""
    first, last, h = result.snapshots[0], result.snapshots[-1], result.history
    kinetic, before = body_energy(first, model)
    _, after = body_energy(last, model)
    ends = np.searchsorted(h.time_s, (first.time_s, last.time_s))
    taken = h.friction_dissipation_J + h.contact_damping_J + h.material_dissipation_J
    taken = taken + h.contact_energy_J - h.drive_work_J
    lost = float(taken[ends[1]] - taken[ends[0]])
    scale = max(kinetic, float(h.kinetic_energy_J.max()))
    open_part = after + lost - before
    if abs(open_part) > ENERGY_BOUND * scale:
        yield f"energy off by {open_part / scale:.3g} of the largest kinetic energy"
    audited = float(np.abs(h.energy_balance_J).max())
    if audited > ENERGY_BOUND * scale:
        yield f"audited energy off by {audited / scale:.3g} of the largest kinetic energy"
