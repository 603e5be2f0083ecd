"""The record of a run: the rows of its history and their energy audit, events, frames."""

import math
from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.assembly.state import Motion, RunTotals
from hcm.beam.chain import Chain
from hcm.beam.energy import energies, stress_at_probe
from hcm.beam.probe import Probe
from hcm.compiled import ByKind, entry_with, kernel, kernel_with
from hcm.contact.contract import (
    axis_end,
    contact_position,
    contact_velocity,
    particle_velocity,
    stored_energy,
    tip_force,
)
from hcm.contact.events import TOUCH
from hcm.contact.law import FLIGHT, ContactState
from hcm.integrators.step import AnyIntegrator
from hcm.results.result import COLUMNS, EVENT_KINDS, Event

# Energies held, then losses, lie between these two columns.
KINETIC, DRIVE_WORK = COLUMNS.index("kinetic"), COLUMNS.index("drive_work")


class EventTable(NamedTuple):
    """Located events: time (m,) s, kind (m,), nodal coordinates q and their rates v (m, n)."""

    time: Floats
    kind: Ints
    q: Floats
    v: Floats


class FrameTable(NamedTuple):
    """Times at which the posture is wanted, (m,) s in rising order, and the postures q (m, n)."""

    time: Floats
    q: Floats


class Record(NamedTuple):
    """What a call of the compiled loop fills.

    rows : (m, len(COLUMNS)), of accepted steps and stages. reactions : (m, 2 P). events, frames.
    """

    rows: Floats
    reactions: Floats
    events: EventTable
    frames: FrameTable


def empty_rows(count: int, chain: Chain) -> tuple[Floats, Floats]:
    """Room for rows and for the hinges' reactions."""
    return np.empty((count, len(COLUMNS))), np.empty((count, 2 * chain.hinge.size))


def empty_record(rows: int, events: int, chain: Chain, frames: FrameTable) -> Record:
    """Room for this many rows and events."""
    q, v = np.empty((2, events, chain.scale.size))
    located = EventTable(np.empty(events), np.empty(events, dtype=np.int64), q, v)
    return Record(*empty_rows(rows, chain), located, frames)


@kernel
def write_row(
    row: Floats, reactions: Floats, motion: Motion, totals: RunTotals, contact: ContactState,
    integrator: AnyIntegrator, probe: Probe,
) -> None:  # fmt: skip
    """Fill one row of the history (in the order of COLUMNS) and of the hinge reactions."""
    chain, law = integrator.chain, integrator.law
    q, v, tip = motion.q, motion.v, chain.tip
    x, gap = contact_position(q, tip, contact, law)
    vt, vn = contact_velocity(q, v, tip, contact, law)
    ft, fn = tip_force(q, v, tip, contact, law)
    kinetic, strain, gravity = energies(q, v, chain)
    row[0], row[1], row[2] = totals.time, fn, ft
    row[3], row[4] = axis_end(q, tip, law)
    row[5], row[6] = axis_end(v, tip, law)
    row[7] = particle_velocity(gap, vt, vn, contact, law)
    row[8] = stress_at_probe(q, v, chain, probe)
    row[9], row[10], row[11] = kinetic, strain, gravity
    row[12] = stored_energy(x, gap, contact, law)
    row[13], row[14] = totals.friction_loss, totals.restitution_loss
    row[15], row[16] = totals.material_loss, totals.drive_work
    row[17] = 3 * contact.normal_mode + contact.tangential_mode
    for w in range(chain.hinge.size):
        for c in range(2):
            reactions[2 * w + c] = motion.acceleration[chain.hinge[w] + c]


@kernel
def hermite(s: float, h: float, q0: float, v0: float, q1: float, v1: float) -> float:
    """The cubic from (q0, v0) to (q1, v1), h later, at a share s of that time."""
    p, r = s * s * (3.0 - 2.0 * s), s * (1.0 - s)
    bend = (1.0 - s) * v0 - s * v1
    return (1.0 - p) * q0 + p * q1 + h * r * bend


@kernel
def frames_inside(totals: RunTotals, h: float, frames: FrameTable) -> tuple[int, int]:
    """Frames [first, end) whose times lie in an accepted step, h long."""
    first = np.searchsorted(frames.time, totals.time, side="right")
    # the same sum as the next step's start: a time near it is in exactly one of the two
    end = np.searchsorted(frames.time, totals.time + h, side="right")
    return int(first), int(end)


@kernel_with()
def total_energy(row: Floats) -> float:
    """Energy held and lost, less the drive's work, J."""
    total = row[KINETIC]
    for column in range(KINETIC + 1, DRIVE_WORK):
        total += row[column]
    return total - row[DRIVE_WORK]


@entry_with()
def largest_imbalance(start: Floats, rows: Floats) -> tuple[float, float]:
    """Largest kinetic energy and largest |energy balance| against `start`, J; NaN if any is NaN.

    start : (len(COLUMNS),) the run's first row. rows : (m, len(COLUMNS)).
    """
    kinetic, largest = start[KINETIC], 0.0
    first = total_energy(start)
    for i in range(rows.shape[0]):
        balance = abs(total_energy(rows[i]) - first)
        if not math.isfinite(balance):
            return kinetic, math.nan
        kinetic, largest = max(kinetic, rows[i, KINETIC]), max(largest, balance)
    return kinetic, largest


largest_imbalance_by_kind = ByKind(largest_imbalance)


class Segment(NamedTuple):
    """Where a run stands after a call of the loop, and what that call has added to its history.

    An interrupt leaves a segment whole or not at all.

    steps, kinetic_J, imbalance_J : accepted steps, largest kinetic energy and largest |energy
    balance| so far (NaN if any is). rows, reactions : (m, len(COLUMNS)) and (m, 2 P).
    events, q, v : (k,), and the bordered coordinates at them and their rates, (k, n).
    """

    contact: ContactState
    totals: RunTotals
    steps: int
    kinetic_J: float
    imbalance_J: float
    rows: Floats
    reactions: Floats
    events: tuple[Event, ...]
    q: Floats
    v: Floats


def first_segment(
    contact: ContactState, totals: RunTotals, rows: Floats, reactions: Floats, steps: int,
    motion: Motion,
) -> Segment:  # fmt: skip
    """The segment up to the beams' start at `motion`: at the first touch, or before any event."""
    touched = contact.normal_mode != FLIGHT
    events = (Event(totals.time, EVENT_KINDS[TOUCH]),) if touched else ()
    q, v = np.empty((2, len(events), motion.q.size))
    q[:], v[:] = motion.q, motion.v
    kinetic, imbalance = largest_imbalance_by_kind(None, rows[0], rows)
    return Segment(contact, totals, steps, kinetic, imbalance, rows, reactions, events, q, v)


def next_segment(
    before: Segment, first_row: Floats, contact: ContactState, totals: RunTotals, steps: int,
    events: int, record: Record,
) -> Segment:  # fmt: skip
    """The segment that a call of the loop returned and wrote; first_row : the run's first row."""
    rows, located = record.rows[:steps].copy(), record.events
    kinetic, imbalance = largest_imbalance_by_kind(None, first_row, rows)
    times, kinds = located.time[:events].tolist(), located.kind[:events].tolist()
    return Segment(
        contact,
        totals,
        before.steps + steps,
        max(before.kinetic_J, kinetic),
        # a NaN compares false
        max(before.imbalance_J, imbalance) if imbalance >= 0 else imbalance,
        rows,
        record.reactions[:steps].copy(),
        tuple([Event(time, EVENT_KINDS[kind]) for time, kind in zip(times, kinds, strict=True)]),
        located.q[:events].copy(),
        located.v[:events].copy(),
    )
