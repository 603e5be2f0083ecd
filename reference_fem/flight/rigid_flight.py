"""The rigid chain's flight down to the surface."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from reference_fem.arrays import Array
from reference_fem.model import Model
from reference_fem.rigid.rigid_chain import ChainState, RigidChain
from reference_fem.settings import Settings

LONGEST_STEP_S, FALL_SHARE = 5e-3, 0.039
"""A step's longest time, and its share of sqrt(reach/g) if that is more: slow flights have no more
steps than others."""
SHALLOW = 1e-5
"""Depth, over the finger's reach, below which a touch may be missed between steps."""


def fly(
    chain: RigidChain,
    start: ChainState,
    gap: Callable[[Array], float],
    end_time_s: float,
    tolerance: float = 1e-11,
) -> tuple[Callable[[float], ChainState], float | None]:
    """Integrate from `start` until the gap of the rigidly moved surface closes.

    Dormand-Prince 8(5,3); a gap that closes and opens again within a step: see `first_closing`.

    gap : height of the lowest surface node above the plane, m, as a function of the angles (P,).
    tolerance : relative, per step.

    Returns a function that gives the state at any time of the flight, and the time of contact, s;
    None if the surface is not reached before `end_time_s`.
    """
    links = chain.links

    def closing(_time: float, state: Array) -> float:
        return gap(state[:links])

    closing.terminal = True  # type: ignore[attr-defined]
    closing.direction = -1  # type: ignore[attr-defined]
    solutions, now = [], np.concatenate([start.angles, start.rates])
    hits: Array = np.empty(0)
    for begin, end, first, rate in chain.torques.pieces(start.time_s, end_time_s):

        def slope(
            time: float, state: Array, begin: float = begin, first: Array = first,
            rate: Array = rate,
        ) -> Array:  # fmt: skip
            return chain.rates_of_change(state, first + (time - begin) * rate)

        # A stage of a step that is far too long may overflow: the step's error is then NaN, and it
        # is shortened.
        with np.errstate(over="ignore", invalid="ignore"):
            solution = solve_ivp(
                slope,
                (begin, end),
                now,
                method="DOP853",
                rtol=tolerance,
                atol=1e-2 * tolerance,
                max_step=_longest_step_s(chain),
                dense_output=True,
                events=closing,
            )
        if not solution.success:
            raise ArithmeticError(f"the rigid flight could not be integrated: {solution.message}")
        solutions.append((end, solution.sol))
        now, hits = solution.y[:, -1], solution.t_events[0]
        earlier = first_closing(chain, solution.sol, solution.t, gap)
        if earlier is not None:
            hits = np.array([earlier])
        if hits.size:
            break

    def state_at(time_s: float) -> ChainState:
        of_piece = next((sol for end, sol in solutions if time_s < end), solutions[-1][1])
        values = of_piece(time_s)
        return ChainState(values[:links], values[links:], time_s)

    return state_at, float(hits[0]) if hits.size else None


def _reaches(chain: RigidChain) -> Array:
    """l_j from hinge to hinge, and what the last body reaches at most, (P,), m: a rod twice as far
    as its mass centre, its rims and ball less than four times as far.
    """
    reach = np.append(np.linalg.norm(np.diff(chain.origins, axis=0), axis=1), 0.0)
    reach[-1] = 4.0 * np.linalg.norm(chain.arms[-1, -1])
    return reach


def _longest_step_s(chain: RigidChain) -> float:
    gravity = float(np.hypot(*chain.gravity_vector))
    fall = math.sqrt(float(_reaches(chain).sum()) / gravity) if gravity > 0.0 else 0.0
    return max(LONGEST_STEP_S, FALL_SHARE * fall)


def first_closing(
    chain: RigidChain, flown: Callable[..., Array], times: Array, gap: Callable[[Array], float]
) -> float | None:
    """First time at which the gap closes between the steps' ends `times`; None if never.

    With l_j from hinge to hinge, the last to the body's farthest point, the gap changes over a time
    h by at most c = Σ l_j h max |ω_j|, so that it stays above (g_0 + g_1 - c)/2 between its ends.
    Where that is negative, h is halved, until c is below Σ l_j times `SHALLOW`. Rates that are
    parabolas over h exceed the largest of both ends and the middle by a quarter at most.
    """
    reach = _reaches(chain)

    def height(time: float) -> float:
        return gap(flown(time)[: chain.links])

    heights = [height(time) for time in times]
    closing, ends = None, list(zip(times, heights, strict=True))
    spans = list(pairwise(ends))[::-1]
    while spans:
        (begin, above), (end, below) = spans.pop()
        middle = 0.5 * (begin + end)
        rates = np.abs(flown(np.array([begin, middle, end]))[chain.links :]).max(axis=1)
        change = 1.25 * (end - begin) * float(reach @ rates)
        if above <= 0.0 or above + below > change or change < SHALLOW * reach.sum():
            continue
        between = height(middle)
        if between < 0.0:
            closing = brentq(height, begin, middle, xtol=1e-15)
            spans = [((begin, above), (closing, 0.0))]
        else:
            spans += [((middle, between), (end, below)), ((begin, above), (middle, between))]
    return closing


def surface_gap(model: Model, chain: RigidChain) -> Callable[[Array], float]:
    """Height above the plane of the lowest point that may touch, m, as a function of the angles.

    The function moves an array of its own: one caller at a time.
    """
    nodes, lowest, body = model.contact.nodes, model.contact.touching_points, model.touching_body
    position, hinges = model.points[nodes], chain.origins @ [1.0, 1j]  # X + iY
    links, arms = np.diff(hinges)[:body], position[:, :2] @ [1.0, 1j] - hinges[body]

    def gap(angles: Array) -> float:
        turns = np.exp(1j * angles)
        place = hinges[0] + links @ turns[:body] + turns[body] * arms
        position[:, 0], position[:, 1] = place.real, place.imag
        return float(np.min(lowest(position)[:, 1])) + model.surface.height

    return gap


def inner_gap(model: Model, chain: RigidChain) -> Callable[[Array], float]:
    """Height above the plane of the lowest rim of the phalanges before the one that may touch, m,
    as a function of the angles; inf if there are none.
    """
    body, hinges = model.touching_body, chain.origins @ [1.0, 1j]
    links = np.diff(hinges)[:body]
    own = [model.points[model.body_of_point == w, 1] for w in range(body)]
    radii = np.array([float(np.abs(y).max()) for y in own])

    def gap(angles: Array) -> float:
        turns = np.exp(1j * angles[:body])
        ends = hinges[0].imag + np.cumsum((links * turns).imag)
        begins = np.concatenate([hinges[:1].imag, ends])[:body]
        rims = np.minimum(begins, ends) - radii * np.abs(turns.real)
        return float(np.min(rims, initial=np.inf)) + model.surface.height

    return gap


@dataclass(frozen=True)
class Descent:
    """A rigid flight down to the surface: its start, when it touches, and its states until then."""

    start: ChainState
    touch_s: float
    state_at: Callable[[float], ChainState]

    def before(self, seconds: float) -> ChainState:
        """The state this long before the touch, or the start's if that is later."""
        return self.state_at(max(self.start.time_s, self.touch_s - seconds))

    def closing_of(self, chain: RigidChain, gap: Callable[[Array], float]) -> float | None:
        """When another gap, a function of the angles, first closes on the way, s; None if never."""

        def flown(times: Array) -> Array:
            states = [self.state_at(float(time)) for time in np.atleast_1d(times)]
            columns = np.array([[*state.angles, *state.rates] for state in states]).T
            return columns if np.ndim(times) else columns[:, 0]

        lasts = self.touch_s - self.start.time_s
        steps = 2 + int(lasts / _longest_step_s(chain))
        return first_closing(chain, flown, np.linspace(self.start.time_s, self.touch_s, steps), gap)


def descent(
    chain: RigidChain, gap: Callable[[Array], float], start: ChainState, settings: Settings
) -> Descent | None:
    """Rigid flight until the gap, a function of the angles, closes; None if it never does."""
    end = start.time_s + settings.max_flight_time_s
    if settings.end_time_s is not None:
        end = min(end, settings.end_time_s)
    if end <= start.time_s:
        return None
    state_at, contact = fly(chain, start, gap, end)
    return None if contact is None else Descent(start, contact, state_at)
