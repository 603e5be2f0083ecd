"""Blocks of a flight, in which contact is not searched for."""

from collections.abc import Callable

import numpy as np

from reference_fem.dynamics.state import State
from reference_fem.dynamics.step import Block, advance
from reference_fem.model import Model

FLIGHT_BLOCK = 1000
"""Steps of a block in flight, where contact is expected to be out of reach for longer."""
SPEED_MARGIN = 1.0
"""Speed that the tip is expected to gain at most within a flight block, m/s."""


def expected_speed(model: Model, state: State) -> float:
    """Largest speed towards the surface that the tip is expected to have within a block, m/s."""
    down = -state.velocity[model.contact.nodes, 1]
    return SPEED_MARGIN + float(np.max(down, initial=0.0))


def flight_block(
    model: Model, state: State, steps: int, is_clear: Callable[[State], bool]
) -> tuple[State, Block] | None:
    """The block of `steps`, or of a half, a quarter, ... of them, until it ends clear of contact.

    A torque may speed the tip up by more than was expected. None: no step ends clear.
    """
    while steps >= 1:
        after, block = advance(model, state, steps, False)
        if is_clear(after):
            return after, block
        steps //= 2
    return None
