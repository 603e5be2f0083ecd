"""What a user of SciPy gets: solve_ivp with its defaults and terminal events, phase by phase.

The same equations in minimal coordinates (`hcm.beam.minimal_coordinates`), no tolerance, no re-
arming, no origin shift: RK45, rtol 1e-3, atol 1e-6, an event function that falls through zero ends
a phase.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

import hcm
from hcm.arrays import Floats
from hcm.beam.chain import build_chain
from hcm.beam.minimal_coordinates import expand, minimal_coordinates, rate
from hcm.contact.events import LIFT_OFF, TOUCH, event_values, transition
from hcm.contact.law import FLIGHT, FREE, Contact, contact_law

MOST_PHASES = 200
LONGEST_FLIGHT_S = 2.0


class TooLongError(Exception):
    """The seconds allowed are over."""


def solve_first_tap(
    finger: hcm.Finger, surface: hcm.Surface, tip: hcm.Tip, drive: hcm.Drive,
    seconds: float, method: str = "RK45",
) -> tuple[str, tuple[float, float] | None]:  # fmt: skip
    """How the first tap ended; its peak F_n, N, and normal impulse, N s, if it did.

    Parameters
    ----------
    seconds : wall time allowed.
    method : of `scipy.integrate.solve_ivp`.
    """
    chain, rest = build_chain(finger, drive)
    law, mapping = contact_law(surface, tip), minimal_coordinates(chain)
    m = mapping.place.size
    x, y = (int(mapping.source[chain.tip + c]) for c in range(2))
    nothing = np.zeros(m)
    state = np.concatenate([rest[mapping.place], nothing, [0.0, 0.0]])
    contact, now, peak, impulse = Contact(FLIGHT, FREE, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0
    end = time.perf_counter() + seconds

    def slope(_time: float, z: Floats) -> Floats:
        if time.perf_counter() > end:
            raise TooLongError
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
            found = solve_ivp(slope, (now, LONGEST_FLIGHT_S), state, method=method,
                              events=[watched(slot) for slot in range(3)])  # fmt: skip
        except TooLongError:
            return f"not done in {seconds:g} s, at t = {now:.4g} s", None
        if found.status < 0:
            return f"{found.message}".partition(".")[0], None
        if not found.y[:, -1].size or not np.isfinite(found.y[:, -1]).all():
            return "not finite", None
        now, state = float(found.t[-1]), found.y[:, -1]
        fired = [slot for slot, times in enumerate(found.t_events) if times.size]
        if not fired:
            return "no event: it flies or presses for ever", None
        q, v = expand(state[:m], mapping.source), expand(state[m : 2 * m], mapping.source)
        end_node = chain.tip
        if contact.normal != FLIGHT:
            gaps = found.y[y] + law.height
            # F_n along the phase, from its own branch
            slope_n = law.k / (1.0 if contact.normal == 1 else law.restitution**2)
            peak = max(peak, float((contact.force_ref - slope_n * (gaps - contact.gap_ref)).max()))
        contact, kind = transition(
            fired[0], q[end_node], q[end_node + 1] + law.height, v[end_node], v[end_node + 1],
            contact, law,
        )  # fmt: skip
        if kind == TOUCH:
            impulse = float(state[2 * m])
        if kind == LIFT_OFF:
            return "completed", (peak, float(state[2 * m]) - impulse)
    return f"{MOST_PHASES} events without an end", None
