"""An accurate solution of the same semi-discrete equations, to judge hcm's integrators by.

Beams, torques, contact law and event functions are hcm's own kernels; the hinges are eliminated
(`minimal_coordinates`) and time is SciPy's: an explicit Runge-Kutta pair of order 8 (DOP853) with
error control, phase by phase, each phase ended by the first event function that falls through zero.
Explicit steps are bounded by the shortest wave (about 1 us at 5 elements a phalanx, shorter by the
square of the refinement), so a tap costs tenths of a second and the flight before it a minute.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from hcm.arrays import Floats
from hcm.assembly.minimal_coordinates import Coordinates, expand, minimal_coordinates, rate
from hcm.beam.chain import Chain, build_chain
from hcm.beam.drive import Piece, piece_at, set_drive, torques_on_nodes
from hcm.contact.events import LIFT_OFF, TO_RESTITUTION, event_values, transition
from hcm.contact.law import FLIGHT, FREE, IN_FLIGHT, ContactLaw, ContactState, contact_law
from hcm.model import check_scene
from hcm.parameters import Drive, Finger, Surface, Tip
from hcm.results.result import EVENT_KINDS, Event

Slots = tuple[float, float, float, float]

# More transitions than this mean chatter, which has no end at any tolerance.
MAX_PHASES = 10_000
# s; the direction of an event function that starts at zero is read after this time.
SIGN_CHECK_S = 1e-9


@dataclass(frozen=True)
class ChainStart:
    """State to start from: bordered coordinates (n,) and velocities (n,) at time_s, and the mode.

    Flight by default: a tip that sits on the surface and moves down then touches at once.
    """

    coordinates: Floats
    velocities: Floats
    time_s: float = 0.0
    contact: ContactState = IN_FLIGHT


@dataclass(frozen=True)
class Truth:
    """A solved tap.

    F_n turns only where v_n = 0, so its peak is the largest value at a compression-restitution
    transition. normal_impulse_N_s and friction_dissipation_J are integrated with the motion.
    end is the state in which the run ended.
    """

    events: tuple[Event, ...]
    peak_normal_force_N: float
    normal_impulse_N_s: float
    friction_dissipation_J: float
    end: ChainStart

    def time_of(self, kind: str) -> float:
        """Time of the first event of a kind, s."""
        return next(e.time_s for e in self.events if e.kind == kind)


def solve(
    finger: Finger,
    surface: Surface,
    tip: Tip,
    drive: Drive = Drive(),  # noqa: B008  frozen
    rtol: float = 1e-10,
    atol: float = 1e-14,
    start: ChainStart | None = None,
    taps: int = 1,
    end_time: float = 2.0,
) -> Truth:
    """Solve a tap from rest, or from `start`, until `taps` separations or `end_time`.

    finger, surface, tip, drive : as for `hcm.simulate`. start : None means at rest along -X.
    rtol : bound on a step's local error relative to the displacement since the phase began.
    atol : m, absolute bound on the same; slopes in units of 1/l, velocities per sqrt(mass/k).
    end_time : s since the start of the motion.

    Raises ParameterError: the parts of the scene do not fit each other.
    Raises RuntimeError: the integrator failed, or the contact chatters without end.
    """
    check_scene(finger, surface, drive)
    chain, rest = build_chain(finger, drive)
    if start is None:
        start = ChainStart(rest, np.zeros_like(rest))
    law = contact_law(surface, tip)
    pieces = torques_on_nodes(drive, len(finger.phalanges))
    return solve_chain(chain, law, start, rtol, atol, taps, end_time, pieces)


def solve_chain(
    chain: Chain, law: ContactLaw, start: ChainStart, rtol: float, atol: float, taps: int = 1,
    end_time: float = 2.0, drive: Sequence[Piece] = (),
) -> Truth:  # fmt: skip
    """`solve` for a chain of elements that is given as arrays; `drive` : torques on its nodes."""
    steady = np.stack([chain.torque, np.zeros_like(chain.torque)])
    drive = drive or (Piece(0.0, math.inf, steady),)
    mapping = minimal_coordinates(chain)
    m = mapping.place.size
    tolerance = _tolerance(mapping, chain, law, atol)
    y = np.concatenate([start.coordinates[mapping.place], start.velocities[mapping.place], [0, 0]])
    time, contact, kind = start.time_s, start.contact, -1
    events: list[Event] = []
    peak, phases = 0.0, 0
    while taps > 0 and time < end_time:
        if phases >= MAX_PHASES:
            raise RuntimeError(
                f"{MAX_PHASES} transitions by t = {time:.9g} s: the contact chatters"
            )
        origin = y[:m].copy()
        y[:m] = 0.0

        piece = piece_at(drive, time)
        until = min(end_time, piece.end_s)

        def slope(
            now: float, y: Floats, origin: Floats = origin, contact: ContactState = contact,
            piece: Piece = piece,
        ) -> Floats:  # fmt: skip
            torques = np.empty_like(piece.torques)
            set_drive(now, piece, torques)
            driven = chain._replace(torque=torques[0])
            return rate(y, origin, mapping, driven, contact, law)

        soon = solve_ivp(
            slope, (time, time + SIGN_CHECK_S), y, method="DOP853", rtol=rtol, atol=tolerance
        )
        functions = _event_functions(time, y, soon.y[:, -1], origin, mapping, chain, contact, law)
        solved = solve_ivp(
            slope, (time, until), y, method="DOP853", events=functions,
            rtol=rtol, atol=tolerance, t_eval=[until],
        )  # fmt: skip
        if solved.status < 0:
            raise RuntimeError(f"the integrator failed at t = {time:.9g} s: {solved.message}")
        fired = [i for i, times in enumerate(solved.t_events) if times.size]
        stop = float(solved.t_events[fired[0]][0]) if fired else until
        y = (solved.y_events[fired[0]][0] if fired else solved.y[:, -1]).copy()
        y[:m] += origin
        time, phases = stop, phases + 1
        q, v = expand(y[:m], mapping.source), expand(y[m : 2 * m], mapping.source)
        if not fired:
            continue
        x, gap = q[chain.tip], q[chain.tip + 1] + law.height
        vt, vn = v[chain.tip], v[chain.tip + 1]
        if functions[fired[0]].slot < 0:  # risen above the surface: a new tap begins at zero gap
            contact = ContactState(FLIGHT, FREE, 0.0, 0.0, 0.0, x)
            continue
        contact, kind = transition(functions[fired[0]].slot, x, gap, vt, vn, contact, law)
        events.append(Event(time, EVENT_KINDS[kind]))
        if kind == TO_RESTITUTION:
            peak = max(peak, contact.force_ref)
        taps -= kind == LIFT_OFF
    end = ChainStart(
        expand(y[:m], mapping.source), expand(y[m : 2 * m], mapping.source), time, contact
    )  # fmt: skip
    return Truth(tuple(events), peak, float(y[-2]), float(y[-1]), end)


def _tolerance(mapping: Coordinates, chain: Chain, law: ContactLaw, atol: float) -> Floats:
    """Absolute tolerances of y: a velocity's is the position's per contact time sqrt(mass/k)."""
    mass = float(chain.mass[:, ::2, ::2].sum())
    period = (mass / law.k) ** 0.5
    position = atol * mapping.unit
    force = atol * law.k
    # the friction's work: the force's tolerance over a micrometre
    return np.concatenate([position, position / period, [force * period, force * 1e-6]])


class _Falling:
    """One slot of `event_values` as SciPy wants it: it ends the phase when it falls through zero.

    slot -1 is the rise above the surface of a tip that left it with a residual deformation.
    A function that starts at zero has just fired, or coincides with one that has, and the sign of
    its round-off means nothing. Its value a moment later decides: a function that rises starts
    below zero (it fires only after it has been positive), one that falls above (it fires at once).
    """

    terminal = True
    direction = -1.0

    def __init__(self, slot: int, values: Callable[[Floats], Slots], begin_s: float, start: Slots,
                 soon: Slots):  # fmt: skip
        self.slot, self.values, self.begin_s = slot, values, begin_s
        self.at_begin = start[slot]
        if abs(start[slot]) < 0.01 * abs(soon[slot]):
            self.at_begin = -math.copysign(1e-300, soon[slot])

    def __call__(self, time: float, y: Floats) -> float:
        return self.values(y)[self.slot] if time > self.begin_s else self.at_begin


def _event_functions(
    begin_s: float, start: Floats, soon: Floats, origin: Floats, mapping: Coordinates, chain: Chain,
    contact: ContactState, law: ContactLaw,
) -> list[_Falling]:  # fmt: skip
    m = mapping.place.size
    x, y = (int(mapping.source[chain.tip + c]) for c in range(2))

    def values(state: Floats) -> Slots:
        gap = origin[y] + state[y] + law.height
        slots = event_values(origin[x] + state[x], gap, state[m + x], state[m + y], contact, law)
        return (*slots, -gap)

    now, later = values(start), values(soon)
    wanted = [slot for slot in range(3) if math.isfinite(now[slot])]
    if contact.normal_mode == FLIGHT and contact.gap_ref < 0.0:
        wanted.append(-1)
    return [_Falling(slot, values, begin_s, now, later) for slot in wanted]
