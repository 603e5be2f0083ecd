"""Where the beams begin: at a given state, or at the touch that ends a rigid flight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hcm.arrays import Floats
from hcm.beam.chain import Probe
from hcm.beam.equations import fill_chords
from hcm.compiled import kernel
from hcm.contact.events import NORMAL, transition
from hcm.contact.law import FLIGHT, FREE, Contact, PlainContact, plain_contact
from hcm.flight import rigid_chain
from hcm.flight.rigid_chain import Rods, clearance
from hcm.flight.rigid_flight import TOUCHED, Fall
from hcm.integrators.generalized_alpha import initial_acceleration
from hcm.integrators.workspace import Integrator
from hcm.loop import COLUMNS, FrameTable, hermite, write_row
from hcm.rigid_start import place
from hcm.state import Clock, Motion, Plan

IN_FLIGHT = Contact(FLIGHT, FREE, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Beginning:
    """What the beams take over.

    rows, reactions : the history so far, (m, len(COLUMNS)) and (m, 2 P), the moment included.
    solved : whether the beams' first acceleration could be found. left_out : share of the tip's
    speed of approach that the beams' vibration may have after a flight as rods.
    """

    contact: Contact
    clock: Clock
    rows: Floats
    reactions: Floats
    solved: bool
    left_out: float = 0.0


@kernel
def clock_at(time: float, step: float) -> Clock:
    """A clock that has counted nothing yet."""
    return Clock(time, time, step, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def first_row(
    row: Floats, reactions: Floats, consistent: bool, old: Motion, clock: Clock, contact: Contact,
    integrator: Integrator, probe: Probe,
) -> bool:  # fmt: skip
    """Write the row that the beams begin with; whether their first acceleration could be found."""
    solved = initial_acceleration(old, contact, integrator) if consistent else True
    write_row(row, reactions, old, clock, contact, integrator, probe)
    return solved


def at_once(
    time: float, step: float, consistent: bool, old: Motion, integrator: Integrator, probe: Probe
) -> Beginning:
    """Begin from `old` in flight, with a first step of at most `step`."""
    rows, reactions = np.empty((1, len(COLUMNS))), np.empty((1, 2 * integrator.chain.hinge.size))
    clock = clock_at(time, step)
    solved = first_row(rows[0], reactions[0], consistent, old, clock, IN_FLIGHT, integrator, probe)
    return Beginning(IN_FLIGHT, clock, rows, reactions, solved)


def after_flight(
    chain: Rods, fall: Fall, consistent: bool, plan: Plan, old: Motion, integrator: Integrator,
    probe: Probe, frames: FrameTable,
) -> Beginning:  # fmt: skip
    """Write the history of a rigid flight, leave `old` at its end and begin there."""
    # one more: where the beams take over, forces jump from the rods' to theirs
    count = fall.time.size + 1
    rows, reactions = np.empty((count, len(COLUMNS))), np.empty((count, 2 * chain.length.size))
    mode, speed, work, solved, shaken = write_flight(
        fall.time, fall.states, fall.accelerations, fall.code == TOUCHED, consistent, chain, old,
        integrator, probe, rows, reactions, frames,
    )  # fmt: skip
    clock = clock_at(float(fall.time[-1]), plan.contact_step)._replace(
        rejected=fall.repeats, trials=fall.trials, drive_work=work, speed=speed
    )
    if fall.code != TOUCHED:
        clock = clock._replace(phase_start=float(fall.time[0]))
    approach = abs(clearance(fall.states[-1], chain)[1])
    left_out = shaken / max(approach, 1e-300)
    return Beginning(Contact(*mode), clock, rows, reactions, solved, left_out)


@kernel
def write_flight(
    time: Floats, states: Floats, accelerations: Floats, touched: bool, consistent: bool,
    chain: Rods, old: Motion, integrator: Integrator, probe: Probe, rows: Floats, reactions: Floats,
    frames: FrameTable,
) -> tuple[PlainContact, float, float, bool, float]:  # fmt: skip
    """Fill the rows, the hinges' reactions and the frames of a rigid flight (`rigid_flight.Fall`).

    The last row is the beams' own, at the time of the one before. Returns the contact there, the
    tip's largest speed so far (m/s), the drive's work (J), whether the beams' first acceleration
    could be found, and the largest speed that rods leave out (m/s).
    """
    beams, law = integrator.chain, integrator.law
    links, tip, frame = chain.length.size, beams.tip, 0
    contact, clock, fastest, work, shaken = IN_FLIGHT, clock_at(time[0], 0.0), 0.0, 0.0, 0.0
    for m in range(time.size):
        if m > 0:
            h = time[m] - time[m - 1]
            while frame < frames.time.size and frames.time[frame] <= time[m]:
                if frames.time[frame] > time[m - 1]:
                    s = (frames.time[frame] - time[m - 1]) / h
                    before, after = states[m - 1], states[m]
                    for w in range(links):
                        chain.between[w] = hermite(
                            s, h, before[w], before[links + w], after[w], after[links + w]
                        )
                    frames.q[frame, :] = 0.0
                    place(chain.between, chain.length, beams, frames.q[frame], old.v)
                frame += 1
        place(states[m], chain.length, beams, old.q, old.v)
        fill_chords(old.q, beams, old.chords)
        left = rigid_chain.reactions(states[m], accelerations[m], chain, reactions[m])
        shaken = max(shaken, left)
        work = 0.0
        for w in range(links):
            old.acceleration[beams.hinge[w]] = reactions[m, 2 * w]
            old.acceleration[beams.hinge[w] + 1] = reactions[m, 2 * w + 1]
            work += chain.torque[w] * (states[m, w] - states[0, w])
        fastest = max(fastest, abs(old.v[tip]) + abs(old.v[tip + 1]))
        clock = Clock(time[m], time[0], 0.0, 0, 0, 0, 0, 0, 0.0, 0.0, work, fastest, 0.0)
        write_row(rows[m], reactions[m], old, clock, contact, integrator, probe)
    if touched:
        x, gap = old.q[tip], old.q[tip + 1] + law.height
        contact, _ = transition(NORMAL, x, gap, old.v[tip], old.v[tip + 1], contact, law)
    old.acceleration[:] = 0.0
    solved = first_row(
        rows[m + 1], reactions[m + 1], consistent, old, clock, contact, integrator, probe
    )
    return plain_contact(contact), fastest, work, solved, shaken
