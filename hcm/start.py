"""Where a run starts: at rest, in a rigid state, or at the touch that ends a rigid flight.

A rigid state has straight, unstrained phalanges. Phalanx w, turned by theta_w from -X, has the
tangent t = (-cos theta, -sin theta) and, turning at omega_w, the nodes

    r(s) = r_w + s t,     r' = t,     v(s) = v_w + s omega n,     v' = omega n,
    n = e_z x t = (sin theta, -cos theta),

r_w and v_w being the end of the phalanx before: the hinges hold at once in position and velocity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hcm.arrays import Floats
from hcm.beam.chain import Chain, Probe
from hcm.beam.equations import fill_chords
from hcm.compiled import kernel
from hcm.contact.events import NORMAL, transition
from hcm.contact.law import IN_FLIGHT, Contact
from hcm.flight import rigid_chain, rigid_flight
from hcm.flight.rigid_chain import Rods, clearance
from hcm.flight.rigid_flight import TOUCHED, RigidFlight
from hcm.integrators.generalized_alpha import initial_acceleration
from hcm.integrators.workspace import Integrator
from hcm.parameters import Finger, ParameterError
from hcm.record import FrameTable, Segment, first_segment, hermite, write_row
from hcm.result import COLUMNS, Status
from hcm.state import Clock, Motion, Plan, initial_clock

_STATUS = {
    rigid_flight.TOUCHED: Status.COMPLETED,
    rigid_flight.ENDED: Status.COMPLETED,
    rigid_flight.FULL: Status.WORK_LIMIT,
    # only steps too long for the motion give no finite error however often they are shortened
    rigid_flight.FAILED: Status.UNBALANCED,
}


@dataclass(frozen=True)
class RigidStart:
    """A rigid state of the finger.

    Parameters
    ----------
    angles : theta_w, rad, counter-clockwise from the rest along -X, one per phalanx.
    rates : omega_w, rad/s, absolute, one per phalanx.
    time_s : time of that state, s, 0 or above.
    """

    angles: tuple[float, ...]
    rates: tuple[float, ...]
    time_s: float = 0.0

    def __post_init__(self) -> None:
        for field in ("angles", "rates"):
            values = getattr(self, field)
            if not all(math.isfinite(value) for value in values):
                raise ParameterError(f"start.{field} = {values!r}: must be finite numbers")
        if not (math.isfinite(self.time_s) and self.time_s >= 0):
            raise ParameterError(f"start.time_s = {self.time_s!r}: must be 0 or above, in s")


def rigid_motion(finger: Finger, chain: Chain, start: RigidStart) -> tuple[Floats, Floats]:
    """Bordered coordinates q and velocities v (n,) of a rigid state.

    Raises
    ------
    ParameterError
        There is not one angle and one rate per phalanx.
    """
    count = len(finger.phalanges)
    if len(start.angles) != count or len(start.rates) != count:
        raise ParameterError(
            f"start has {len(start.angles)} angles and {len(start.rates)} rates:"
            f" must be one of each per phalanx ({count})"
        )
    q, v = np.zeros(chain.weight.size), np.zeros(chain.weight.size)
    lengths = np.array([p.length for p in finger.phalanges])
    fill_rigid_motion(np.array([*start.angles, *start.rates], dtype=float), lengths, chain, q, v)
    return q, v


@kernel
def fill_rigid_motion(state: Floats, lengths: Floats, chain: Chain, q: Floats, v: Floats) -> None:
    """Write the nodes of rigid phalanges, theta and theta. in `state` (2 P,), to q and v (n,).

    lengths : (P,) of the phalanges, m.
    """
    x, y, vx, vy, links = 0.0, 0.0, 0.0, 0.0, lengths.size
    for w in range(links):
        tx, ty = -math.cos(state[w]), -math.sin(state[w])
        nx, ny = -state[links + w] * ty, state[links + w] * tx
        first = chain.hinge_outer[w]
        last = chain.hinge_inner[w + 1] if w + 1 < links else chain.tip
        for node in range(first, last + 1, 4):
            s = lengths[w] * (node - first) / max(last - first, 1)
            q[node], q[node + 1], q[node + 2], q[node + 3] = x + s * tx, y + s * ty, tx, ty
            v[node], v[node + 1], v[node + 2], v[node + 3] = vx + s * nx, vy + s * ny, nx, ny
        x, y, vx, vy = q[last], q[last + 1], v[last], v[last + 1]


@dataclass(frozen=True)
class BeamStart:
    """What the beams start from.

    segment : the history so far, the moment included. status : COMPLETED if they may go on, else
    why not. left_out : share of the tip's speed of approach that the beams' vibration may have
    after a flight as rods.
    """

    segment: Segment
    status: Status = Status.COMPLETED
    left_out: float = 0.0


@kernel
def write_first_row(
    row: Floats, reactions: Floats, consistent: bool, old: Motion, clock: Clock, contact: Contact,
    integrator: Integrator, probe: Probe,
) -> bool:  # fmt: skip
    """Write the row that the beams start with; whether their first acceleration could be found."""
    solved = initial_acceleration(old, contact, integrator) if consistent else True
    write_row(row, reactions, old, clock, contact, integrator, probe)
    return solved


def start_in_flight(
    time: float, step: float, consistent: bool, old: Motion, integrator: Integrator, probe: Probe
) -> BeamStart:
    """Start from `old` in flight, with a first step of at most `step`."""
    rows, reactions = np.empty((1, len(COLUMNS))), np.empty((1, 2 * integrator.chain.hinge.size))
    clock = initial_clock(time, step)
    solved = write_first_row(
        rows[0], reactions[0], consistent, old, clock, IN_FLIGHT, integrator, probe
    )
    segment = first_segment(IN_FLIGHT, clock, rows, reactions, 0, False, old)
    return BeamStart(segment, Status.COMPLETED if solved else Status.NEWTON_FAILED)


def start_after_flight(
    rods: Rods, flight: RigidFlight, consistent: bool, plan: Plan, old: Motion,
    integrator: Integrator, probe: Probe, frames: FrameTable,
) -> BeamStart:  # fmt: skip
    """Write the history of a rigid flight, leave `old` at its end and start there."""
    # one more: where the beams take over, forces jump from the rods' to theirs
    count, touched = flight.time.size + 1, flight.code == TOUCHED
    rows, reactions = np.empty((count, len(COLUMNS))), np.empty((count, 2 * rods.length.size))
    contact, speed, work, solved, shaken = write_flight(
        flight.time, flight.states, flight.accelerations, touched, consistent, rods, old,
        integrator, probe, rows, reactions, frames,
    )  # fmt: skip
    clock = initial_clock(float(flight.time[-1]), plan.contact_step)._replace(
        rejected=flight.repeats, trials=flight.trials, drive_work=work, speed=speed
    )
    if not touched:
        clock = clock._replace(phase_start=float(flight.time[0]))
    approach = abs(clearance(flight.states[-1], rods)[1])
    return BeamStart(
        first_segment(Contact(*contact), clock, rows, reactions, count - 2, touched, old),
        _STATUS[flight.code] if solved else Status.NEWTON_FAILED,
        shaken / max(approach, 1e-300),
    )


@kernel
def write_flight(
    time: Floats, states: Floats, accelerations: Floats, touched: bool, consistent: bool,
    rods: Rods, old: Motion, integrator: Integrator, probe: Probe, rows: Floats, reactions: Floats,
    frames: FrameTable,
) -> tuple[tuple[float, ...], float, float, bool, float]:  # fmt: skip
    """Fill the rows, the hinges' reactions and the frames of a rigid flight (`RigidFlight`).

    The last row is the beams' own, at the time of the one before. Returns the fields of the contact
    there, the tip's largest speed so far (m/s), the drive's work (J), whether the beams' first
    acceleration could be found, and the largest speed that rods leave out (m/s).
    """
    beams, law = integrator.chain, integrator.law
    links, tip, frame = rods.length.size, beams.tip, 0
    contact, clock, fastest, work, shaken = IN_FLIGHT, initial_clock(time[0], 0.0), 0.0, 0.0, 0.0
    for m in range(time.size):
        if m > 0:
            h = time[m] - time[m - 1]
            while frame < frames.time.size and frames.time[frame] <= time[m]:
                if frames.time[frame] > time[m - 1]:
                    s = (frames.time[frame] - time[m - 1]) / h
                    before, after = states[m - 1], states[m]
                    for w in range(links):
                        rods.between[w] = hermite(
                            s, h, before[w], before[links + w], after[w], after[links + w]
                        )
                    frames.q[frame, :] = 0.0
                    fill_rigid_motion(rods.between, rods.length, beams, frames.q[frame], old.v)
                frame += 1
        fill_rigid_motion(states[m], rods.length, beams, old.q, old.v)
        fill_chords(old.q, beams, old.chords)
        left = rigid_chain.reactions(states[m], accelerations[m], rods, reactions[m])
        shaken = max(shaken, left)
        work = 0.0
        for w in range(links):
            old.acceleration[beams.hinge[w]] = reactions[m, 2 * w]
            old.acceleration[beams.hinge[w] + 1] = reactions[m, 2 * w + 1]
            work += rods.torque[w] * (states[m, w] - states[0, w])
        fastest = max(fastest, abs(old.v[tip]) + abs(old.v[tip + 1]))
        clock = Clock(time[m], time[0], 0.0, 0, 0, 0, 0, 0, 0.0, 0.0, work, fastest, 0.0)
        write_row(rows[m], reactions[m], old, clock, contact, integrator, probe)
    if touched:
        x, gap = old.q[tip], old.q[tip + 1] + law.height
        contact, _ = transition(NORMAL, x, gap, old.v[tip], old.v[tip + 1], contact, law)
    old.acceleration[:] = 0.0
    solved = write_first_row(
        rows[m + 1], reactions[m + 1], consistent, old, clock, contact, integrator, probe
    )
    return contact[:], fastest, work, solved, shaken
