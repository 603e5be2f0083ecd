"""What a user of SciPy gets: solve_ivp with its defaults and terminal events, phase by phase.

The same equations in minimal coordinates (`hcm.assembly.minimal_coordinates`), without event
tolerance, re-arming or shift of the origin: RK45, rtol 1e-3, atol 1e-6; an event function that
falls through zero ends a phase.
"""

import time
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

import hcm
from hcm.arrays import Floats
from hcm.assembly.minimal_coordinates import minimal_coordinates, rate
from hcm.beam.chain import build_chain
from hcm.contact.events import LIFT_OFF, TOUCH, event_values, transition
from hcm.contact.law import FLIGHT, FREE, ContactState, contact_law, normal_slope

MOST_PHASES = 200
LONGEST_FLIGHT_S = 2.0


def solve_first_tap(scene: hcm.Scene, seconds: float) -> tuple[str, tuple[float, float] | None]:
    """How the first tap from rest ended; if completed, its peak F_n, N, and normal impulse, N s.

    seconds : wall time allowed.
    """
    chain, rest = build_chain(scene.finger, scene.drive)
    law, mapping = contact_law(scene.surface, scene.tip), minimal_coordinates(chain)
    m = mapping.place.size
    x, y = (int(mapping.source[chain.tip + c]) for c in range(2))  # the tip's place in the state
    nothing = np.zeros(m)
    state = np.concatenate([rest[mapping.place], nothing, [0.0, 0.0]])
    contact, now, peak, impulse = ContactState(FLIGHT, FREE, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0
    end = time.perf_counter() + seconds

    def slope(_time: float, z: Floats) -> Floats:
        if time.perf_counter() > end:
            raise TimeoutError
        return rate(z, nothing, mapping, chain, contact, law)

    def watched(slot: int) -> Callable[[float, Floats], float]:
        def value(_time: float, z: Floats) -> float:
            gap = z[y] + law.height
            found = event_values(z[x], gap, z[m + x], z[m + y], contact, law)[slot]
            return min(found, 1e300)

        value.terminal, value.direction = True, -1.0  # type: ignore[attr-defined]
        return value

    for _ in range(MOST_PHASES):
        try:
            found = solve_ivp(slope, (now, LONGEST_FLIGHT_S), state,
                              events=[watched(slot) for slot in range(3)])  # fmt: skip
        except TimeoutError:
            return f"not done in {seconds:g} s, at t = {now:.4g} s", None
        if found.status < 0:
            return f"{found.message}".partition(".")[0], None
        if not found.y[:, -1].size or not np.isfinite(found.y[:, -1]).all():
            return "not finite", None
        now, state = float(found.t[-1]), found.y[:, -1]
        fired = [slot for slot, times in enumerate(found.t_events) if times.size]
        if not fired:
            return "no event: it flies or presses for ever", None
        if contact.normal_mode != FLIGHT:
            gaps = found.y[y] + law.height
            force = contact.force_ref - normal_slope(0.0, contact, law) * (gaps - contact.gap_ref)
            peak = max(peak, float(force.max()))
        contact, kind = transition(
            fired[0], state[x], state[y] + law.height, state[m + x], state[m + y], contact, law
        )  # fmt: skip
        if kind == TOUCH:
            impulse = float(state[2 * m])
        if kind == LIFT_OFF:
            return "completed", (peak, float(state[2 * m]) - impulse)
    return f"{MOST_PHASES} events without an end", None
