"""What a run has come to, a piece at a time: an interrupt leaves each whole or not at all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats
from hcm.audit import largest_imbalance
from hcm.contact.events import TOUCH
from hcm.contact.law import Contact, PlainContact
from hcm.loop import PlainClock, Record
from hcm.result import EVENT_KINDS, Event
from hcm.start import Beginning
from hcm.state import Clock, Motion


class Piece(NamedTuple):
    """Where a run stands after a call of the loop, and what that call has added to its history.

    steps, kinetic_J, imbalance_J : accepted steps, largest kinetic energy and largest |energy
    balance| so far (NaN if any is). rows, reactions : (m, len(COLUMNS)) and (m, 2 P).
    events, q, v : (k,), and the bordered coordinates at them and their rates, (k, n).
    """

    contact: Contact
    clock: Clock
    steps: int
    kinetic_J: float
    imbalance_J: float
    rows: Floats
    reactions: Floats
    events: tuple[Event, ...]
    q: Floats
    v: Floats


def first_piece(begun: Beginning, steps: int, touched: bool, old: Motion) -> Piece:
    """Where the beams begin, at `old`: at the first touch, or before any event."""
    kinetic, imbalance = largest_imbalance(begun.rows[0], begun.rows)
    events = (Event(begun.clock.time, EVENT_KINDS[TOUCH]),) if touched else ()
    q, v = np.empty((2, len(events), old.q.size))
    q[:], v[:] = old.q, old.v
    return Piece(
        begun.contact,
        begun.clock,
        steps,
        kinetic,
        imbalance,
        begun.rows,
        begun.reactions,
        events,
        q,
        v,
    )


def next_piece(
    before: Piece, start: Floats, contact: PlainContact, clock: PlainClock, steps: int, events: int,
    record: Record,
) -> Piece:  # fmt: skip
    """What a call of the loop returned and wrote; `start` is the run's first row."""
    rows, located = record.rows[:steps].copy(), record.events
    kinetic, imbalance = largest_imbalance(start, rows)
    return Piece(
        Contact(*contact),
        Clock(*clock),
        before.steps + steps,
        max(before.kinetic_J, kinetic),
        # a NaN compares false
        max(before.imbalance_J, imbalance) if imbalance >= 0 else imbalance,
        rows,
        record.reactions[:steps].copy(),
        tuple(
            [
                Event(moment, EVENT_KINDS[kind])
                for moment, kind in zip(
                    located.time[:events].tolist(), located.kind[:events].tolist(), strict=True
                )
            ]
        ),
        located.q[:events].copy(),
        located.v[:events].copy(),
    )
