"""Joint torques over time: linear pieces between kinks; each kink ends a step.

Within a piece the torques are as smooth as the motion, and integrators keep their order.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.compiled import entry_with, kernel
from hcm.parameters import Drive

# Share of the time within which a step's end counts as on a kink; the loop ends pieces within half.
SAME_TIME = 2e-12


class Piece(NamedTuple):
    """Torques from begin_s until before end_s, s: at the beginning, N m, and their rates, N m/s.

    torques : (2, n), of n joints, nodes or bodies.
    """

    begin_s: float
    end_s: float
    torques: Floats


@entry_with()
def set_drive(time_s: float, piece: Piece, drive: Floats) -> None:
    """Fill `drive` (2, n) with a piece's torques at a time and their rates."""
    passed = max(time_s - piece.begin_s, 0.0)
    for t in range(drive.shape[1]):
        drive[0, t] = piece.torques[0, t] + passed * piece.torques[1, t]
        drive[1, t] = piece.torques[1, t]


def torque_rows(drive: Drive, count: int) -> Floats:
    """Torques (m, P), N m, of `count` joints: at each time of a table, or the constant ones."""
    constant = (drive.torques or (0.0,) * count,)
    return np.array(constant if drive.table is None else drive.table.values, dtype=float)


def _pieces(drive: Drive, values: Floats) -> tuple[Piece, ...]:
    held = np.zeros(values.shape[1])
    if drive.table is None:
        return (Piece(0.0, math.inf, np.array([values[0], held])),)
    time = drive.table.time
    found = [Piece(0.0, time[0], np.array([values[0], held]))]
    for (begin, first), (end, last) in pairwise(zip(time, values, strict=True)):
        if end > begin:
            found.append(Piece(begin, end, np.array([first, (last - first) / (end - begin)])))
    found.append(Piece(time[-1], math.inf, np.array([values[-1], held])))
    return tuple(piece for piece in found if piece.end_s > piece.begin_s)


def piece_at(pieces: Sequence[Piece], time_s: float) -> Piece:
    """The piece that goes on after a time; one that ends there, to round-off, is over."""
    now = time_s * (1.0 + SAME_TIME)
    for piece in pieces:  # a generator takes three times as long
        if piece.end_s > now:
            return piece
    raise ValueError(f"no piece goes on from {time_s} s")


def acting_joints(drive: Drive, count: int) -> tuple[Ints, Ints]:
    """Joint (T,) of each torque on a node, and its sign: -1 for a reaction, which comes second."""
    if not drive.has_torques:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    values = torque_rows(drive, count)
    found: list[tuple[int, int]] = []
    for w in np.flatnonzero(values.any(axis=0)).tolist():
        found += [(w, 1), (w, -1)] if drive.reaction and w > 0 else [(w, 1)]
    joint, sign = np.array(found, dtype=np.int64).reshape(-1, 2).T
    return joint, sign


def torques_on_nodes(drive: Drive, count: int) -> tuple[Piece, ...]:
    """Pieces of the torques on a chain's driven nodes, in the order of `acting_joints`."""
    joint, sign = acting_joints(drive, count)
    if drive.table is None and not joint.size:
        return (Piece(0.0, math.inf, np.zeros((2, 0))),)
    return _pieces(drive, sign * torque_rows(drive, count)[:, joint])


def torques_on_rods(drive: Drive, count: int) -> tuple[Piece, ...]:
    """Pieces of the torques on rigid phalanges, reactions included."""
    if not drive.has_torques:
        return (Piece(0.0, math.inf, np.zeros((2, count))),)
    values = torque_rows(drive, count)
    if drive.reaction:
        values[:, :-1] -= values[:, 1:].copy()
    return _pieces(drive, values)


@kernel
def set_torques(drive: Floats, h: float, torque: Floats) -> None:
    """Fill `torque` (T,) with the torques a time h after `drive` (2, T), in the same piece."""
    for t in range(torque.size):
        torque[t] = drive[0, t] + h * drive[1, t]
