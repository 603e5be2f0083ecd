"""Transitions of a contact that is spread over many nodes, from its resultant."""

from dataclasses import dataclass

import numpy as np

from reference_fem.arrays import Array


def confirmed_maxima(force: Array, prominence: float) -> list[int]:
    """Indices of the maxima of F that differ from the minima beside them by at least `prominence`.

    dF_n/dt = -Σ k_i v_ni over the touching nodes (nodes come and go with zero force), so a
    maximum of F_n is where the contact area's stiffness-weighted mean normal velocity changes
    from compression to restitution. High-frequency ringing of single nodes would add countless
    turning points; a turn counts once the curve has gone `prominence` beyond it.

    force : (n,), F_n, N. prominence : N, greater than 0.
    """
    maxima: list[int] = []
    rising, place = True, 0
    for i, value in enumerate(force):
        ahead = value > force[place] if rising else value < force[place]
        if ahead:
            place = i
        elif abs(value - force[place]) >= prominence:
            if rising:
                maxima.append(place)
            rising, place = not rising, i
    return maxima


@dataclass(frozen=True)
class SlipStates:
    """Counts of the resultant's transitions, and whether it slipped both ways."""

    stick_to_slip: int
    slip_to_stick: int
    reverse_slip: bool


def slip_states(
    normal: Array, tangential: Array, friction: float, least_normal: float
) -> SlipStates:
    """Stick and slip of the resultant, by its cone ratio q = |F_t| / (μ F_n).

    The contact slips as a whole where q >= 0.98 and sticks at least in part where q < 0.95;
    in between the previous state holds (at q = 1 exactly every node slips, and in one direction;
    lateral bulging keeps q a little lower). Samples with F_n below `least_normal` are left out.
    Reverse slip: slipping occurs with both signs of F_t.

    normal, tangential : (n,), F_n and F_t, N. friction : μ, greater than 0. least_normal : N.
    """
    counted = normal >= least_normal
    f_t = tangential[counted]
    ratio = np.abs(f_t) / (friction * normal[counted])
    change = np.where(ratio >= 0.98, 1, np.where(ratio < 0.95, -1, 0))
    decided = np.flatnonzero(change)
    states = change[decided]
    turns = np.diff(states)
    signs = np.sign(f_t[ratio >= 0.98])
    return SlipStates(
        stick_to_slip=int(np.count_nonzero(turns > 0)),
        slip_to_stick=int(np.count_nonzero(turns < 0)),
        reverse_slip=bool((signs > 0).any() and (signs < 0).any()),
    )
