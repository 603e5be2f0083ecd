"""Choose the step's length by Newton's convergence, the phase's tolerance and the first event."""

import math

from hcm.assembly.state import Motion, RunTotals, StepLimits
from hcm.compiled import kernel
from hcm.contact.contract import Law, normal_slope
from hcm.contact.events import SEPARATION, SlotValues
from hcm.contact.law import FLIGHT, STICK, ContactState
from hcm.integrators.event_search import NO_EVENT, overshot
from hcm.integrators.newton import drop
from hcm.integrators.stages import find_event
from hcm.integrators.step import AnyIntegrator, error_of_step, take_step

# A step is tried again at most this often, shorter each time.
REPEATS = 40
# A contact step's local error, over the distance that the tip goes in it at its largest speed: a
# stiff surface is dented by less than any tolerance in metres. On a spring it bounds (omega h)^2.
TRAVEL_SHARE = 1e-3
# A flight step's local error, over the tip's clearance: a tip that has just left may touch again
# within its own vibration, which the tolerance of a free flight skips.
CLEARANCE_SHARE = 0.01
# Least and largest factor by which error control changes a step at once; the least growth made.
SHRINK, GROW, LEAST_CHANGE = 0.2, 1.5, 1.2
# In an undamped flight the step grows only if the error allows this factor, and shrinks only if a
# step fails: steps that followed each swing of the vibration would feed its highest modes.
UNDAMPED_MARGIN = 2.0


@kernel
def event_tolerances(
    contact: ContactState, totals: RunTotals, limits: StepLimits, law: Law
) -> SlotValues:
    """Round-off of each event function: metres or m/s, N, and m/s or N."""
    ahead = contact.gap_ref - totals.speed * limits.contact_step
    slope = normal_slope(ahead, contact, law)
    force = max(totals.force, slope * totals.speed * limits.contact_step)
    speed_tolerance, force_tolerance = 1e-12 * totals.speed, 1e-12 * force
    return (
        1e-16 if contact.normal_mode == FLIGHT else speed_tolerance,
        force_tolerance,
        force_tolerance if contact.tangential_mode == STICK else speed_tolerance,
    )


@kernel
def accepted_step(
    h: float, in_flight: bool, rebound: bool, chatter: bool, speed: float, tolerance: SlotValues,
    limits: StepLimits, contact: ContactState, old: Motion, new: Motion, integrator: AnyIntegrator,
) -> tuple[float, int, int, int, float]:  # fmt: skip
    """Take a step of at most h that converges, keeps the phase's tolerance and ends on any event.

    During chatter the step is whole, and an event that it has passed fires at its end. Separation
    alone is still located: the surface would pull until then.

    Returns its length, the slot that fires, the trials and the repeats used, and the factor by
    which the next step may grow. More than `REPEATS` repeats mean failure.
    """
    chain, law, work = integrator.chain, integrator.law, integrator.work
    clearance = max(old.q[chain.tip + 1] + law.height - contact.gap_ref, 0.0)
    slot, trials, growth = NO_EVENT, 0, GROW
    for repeats in range(REPEATS + 1):
        if not take_step(h, contact, old, new, integrator):
            drop(work.kept)
            h *= 0.5
            continue
        bound = min(limits.contact_tolerance, TRAVEL_SHARE * speed * h)
        if in_flight:
            near = bound + CLEARANCE_SHARE * clearance if bound > 0.0 else limits.flight_tolerance
            bound = min(limits.flight_tolerance, near)
        if bound > 0.0:
            error, order = error_of_step(h, contact, old, new, integrator)
            growth = 0.9 * (bound / max(error, 1e-3 * bound)) ** (1.0 / order)
            if error > bound:
                h *= max(SHRINK, growth)
                continue
            # a changed step costs a factorization: small gains are not worth one
            if rebound:
                growth = GROW if growth > UNDAMPED_MARGIN else 1.0
            else:
                growth = min(growth, GROW) if growth > LEAST_CHANGE or growth < 1.0 else 1.0
        located = tolerance
        if chatter:
            slot = overshot(tolerance, new, contact, integrator)
            if slot != SEPARATION:
                return h, slot, trials, repeats, growth
            located = math.inf, tolerance[SEPARATION], math.inf
        length, slot, used = find_event(h, located, contact, old, new, integrator)
        trials += used
        if math.isfinite(length):
            return length, slot, trials, repeats, growth
        drop(work.kept)
        h *= 0.5
    return h, NO_EVENT, trials, REPEATS + 1, growth
