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
    """The block of `steps`, or of those before the tip may pass the surface; None: there are none.

    Where it may pass between two looks, a half, a quarter, ... of their steps end the block.

    gap : lowest gap of a state, m.
    """
    if steps < 1:
        return None
    look, left, above, blocks = min(LOOK, steps), steps, gap(state), list[Block]()
    while look >= 1:
        after, block = advance(model, state, look, False)
        below = gap(after)
        if _may_pass(model, (state, above), (after, below)):
            look, left = look // 2, 0
            continue
        blocks.append(block)
        state, above, left = after, below, max(left - look, 0)
        look = min(LOOK, left)
    if not blocks:
        return None
    return state, replace(blocks[0], log=np.concatenate([block.log for block in blocks]))


def _may_pass(model: Model, before: tuple[State, float], after: tuple[State, float]) -> bool:
    """Whether the tip may have passed the surface between two states, each with its lowest gap.

    It may if it ends below, or if it may have moved down from the first and up to the second, at
    `FASTER` times the speeds down d_0 and up u_1 there, and below the surface between: over the
    time T the lines g_0 - d_0 t and g_1 - u_1 (T - t) meet at a gap

        (g_0 u_1 + g_1 d_0 - d_0 u_1 T)/(d_0 + u_1) < 0.

    A NaN, of a flight that diverged, passes nothing: it ends in its audit.
    """
    (start, above), (end, below) = before, after
    down, up = FASTER * speed_down(model, start), FASTER * speed_up(model, end)
    lasts = (end.step - start.step) * model.step_s
    return below < 0.0 or above * up + below * down < down * up * lasts
