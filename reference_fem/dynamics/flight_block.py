"""Blocks of a flight, in which contact is not searched for."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from reference_fem.dynamics.state import State
from reference_fem.dynamics.step import Block, advance
from reference_fem.model import Model

FLIGHT_BLOCK = 1000
"""Steps of a block in flight, where contact is expected to be out of reach for longer."""
LOOK = 100
"""Steps between two looks at the surface: a tip as fast as a tenth of a wave passes ten edges."""
FASTER = 2.0
"""How many times as fast as at two looks the tip may be between them."""


def speed_down(model: Model, state: State) -> float:
    """Largest speed down of the nodes that may touch, m/s; at least 0."""
    return float(np.max(-state.velocity[model.contact.nodes, 1], initial=0.0))


def speed_up(model: Model, state: State) -> float:
    """Largest speed up of the nodes that may touch, m/s; at least 0."""
    return float(np.max(state.velocity[model.contact.nodes, 1], initial=0.0))


def closing_speed(model: Model, state: State) -> float:
    """Speed down that the tip is expected to have until the next look, a time T later, m/s.

    v_- + (v^2/L + g) T: turning about its hinges, L long, it gains v^2/L beside gravity.
    """
    speed = np.linalg.norm(state.velocity[model.contact.nodes], axis=1).max()
    gained = speed**2 / np.ptp(model.points[:, 0]) + np.hypot(*model.gravity_vector)
    return speed_down(model, state) + float(gained) * LOOK * model.step_s


def flight_block(
    model: Model, state: State, steps: int, gap: Callable[[State], float]
) -> tuple[State, Block] | None:
    """The block of `steps`, or of fewer that are clear of contact; None: not one of them is.

    gap : lowest gap of a state, m.
    """
    after, blocks, left = state, list[Block](), steps
    while left > 0:
        flown = _clear(model, after, min(LOOK, left), gap)
        if flown is None:
            break
        after = flown[0]
        blocks.append(flown[1])
        whole = len(flown[1].log) == min(LOOK, left)
        left = state.step + steps - after.step if whole else 0
    if not blocks:
        return None
    return after, replace(blocks[0], log=np.concatenate([block.log for block in blocks]))


def _clear(
    model: Model, state: State, steps: int, gap: Callable[[State], float]
) -> tuple[State, Block] | None:
    """`steps`, or a half, a quarter, ... of them, until they are clear of contact; None: none are.

    They are if they end above the surface, and if a tip that moves down from their start and up to
    their end, at `FASTER` times the speeds down d_0 and up u_1 there, stays above it: over the time
    T the lines g_0 - d_0 t and g_1 - u_1 (T - t) meet at a gap

        (g_0 u_1 + g_1 d_0 - d_0 u_1 T)/(d_0 + u_1) >= 0.
    """
    above, down = gap(state), FASTER * speed_down(model, state)
    while steps >= 1:
        after, block = advance(model, state, steps, False)
        below, up = gap(after), FASTER * speed_up(model, after)
        passes = above * up + below * down < down * up * steps * model.step_s
        if not (below < 0.0 or passes):  # a NaN, of a flight that diverged, ends in its audit
            return after, block
        steps //= 2
    return None
