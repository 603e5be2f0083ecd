"""The state that steps are taken from: the motion, and the scalars that travel with it."""

from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats
from hcm.assembly.equations import fill_chords
from hcm.beam.chain import Chain
from hcm.beam.joint_torque import turn_rate, turned_angle
from hcm.compiled import entry, kernel
from hcm.contact.contract import (
    Law,
    contact_force,
    contact_position,
    hysteresis_loss,
    shear_work,
)
from hcm.contact.law import ContactState

# Share of the time: a smaller remainder before an end time is not stepped.
LAST_STEP = 1e-12


class Motion(NamedTuple):
    """State of the integrators: q, v, bordered acceleration (q.., lam) and a, each (n,).

    a : generalized-alpha's auxiliary acceleration; after a step of collocation the step's mean
    acceleration, from which the next step's stages start. chords : (N, 2) of the elements, summed
    up from the steps' increments. jerk : (n,) slope of the acceleration over the step that led
    here, only used to predict the next acceleration. drive : (2, T) torques now (N m) and their
    rates (N m/s), until the drive's next kink.
    """

    q: Floats
    v: Floats
    acceleration: Floats
    a: Floats
    chords: Floats
    jerk: Floats
    drive: Floats


class StepLimits(NamedTuple):
    """Step sizes and limits of a run, from `Settings` (seconds, metres, counts).

    taps : number of separations that ends the run; 0: its first touch does. iterations : total of
    Newton iterations at which the loop returns. undamped : whether generalized-alpha takes xi = 1
    in flights after a tap.
    """

    flight_step: float
    contact_step: float
    taps: int
    end_time: float
    flight_tolerance: float
    contact_tolerance: float
    max_flight_time: float
    max_contact_time: float
    iterations: int = np.iinfo(np.int64).max
    undamped: bool = False


class RunTotals(NamedTuple):
    """A run's totals, and the other scalars that travel with its state.

    time, phase_start : s. step : s, current step. taps : separations so far.
    instant : events in a row without an advance. rejected, trials, chatter_steps : counts.
    friction_loss, restitution_loss, material_loss, drive_work : J, accumulated. speed, force :
    scales of the tip's speed (m/s) and of F_n (N) so far, for the events' round-off.
    """

    time: float
    phase_start: float
    step: float
    taps: int
    instant: int
    rejected: int
    trials: int
    chatter_steps: int
    friction_loss: float
    restitution_loss: float
    material_loss: float
    drive_work: float
    speed: float
    force: float


def empty_motion(chain: Chain) -> Motion:
    """A state of zeros, to be filled."""
    q, v, acceleration, a, jerk = np.zeros((5, chain.scale.size))
    chords, drive = np.zeros((chain.first.size, 2)), np.zeros((2, chain.torque.size))
    return Motion(q, v, acceleration, a, chords, jerk, drive)


def build_motion(chain: Chain, q: Floats, v: Floats) -> Motion:
    """A state with coordinates q and velocities v (n,), accelerations zero."""
    motion = empty_motion(chain)
    motion.q[:], motion.v[:], motion.drive[0] = q, v, chain.torque
    fill_chords(q, chain, motion.chords)
    return motion


@entry
def initial_totals(time: float, step: float) -> RunTotals:
    """Totals of a run that begins."""
    return RunTotals(
        time=time, phase_start=time, step=step, taps=0, instant=0,
        rejected=0, trials=0, chatter_steps=0, speed=0.0, force=0.0,
        friction_loss=0.0, restitution_loss=0.0, material_loss=0.0, drive_work=0.0,
    )  # fmt: skip


@kernel
def advance_totals(
    totals: RunTotals, h: float, friction: float, material_loss: float, old: Motion, new: Motion,
    chain: Chain, contact: ContactState, law: Law,
) -> RunTotals:  # fmt: skip
    """Advance the time by an accepted step and add its losses and works.

    friction : its total loss so far, J, to which the contact's `shear_work` is added.
    material_loss : that of this step, J. Restitution loss is exact, and the drive's work too,
    except for changing torques (of order 4).
    """
    tip = chain.tip
    _, y0 = contact_position(old.q, tip, contact, law)
    x1, y1 = contact_position(new.q, tip, contact, law)
    force = contact_force(x1, y1, contact, law)
    work = 0.0
    for t in range(chain.torque.size):
        s = chain.torque_node[t] + 2
        turn = turned_angle(old.q[s], old.q[s + 1], new.q[s], new.q[s + 1])
        work += 0.5 * (old.drive[0, t] + new.drive[0, t]) * turn
        # int (t - h/2) dtheta, for a spin that is linear in time
        gained = turn_rate(new.q[s], new.q[s + 1], new.v[s], new.v[s + 1])
        gained -= turn_rate(old.q[s], old.q[s + 1], old.v[s], old.v[s + 1])
        work += old.drive[1, t] * h * h / 12.0 * gained
    return RunTotals(
        time=totals.time + h,
        phase_start=totals.phase_start,
        step=totals.step,
        taps=totals.taps,
        instant=totals.instant if h == 0.0 else 0,
        rejected=totals.rejected,
        trials=totals.trials,
        chatter_steps=totals.chatter_steps,
        friction_loss=friction + shear_work(new.q, tip, force, contact, law),
        restitution_loss=totals.restitution_loss + hysteresis_loss(y0, y1, contact, law),
        material_loss=totals.material_loss + material_loss,
        drive_work=totals.drive_work + work,
        speed=max(totals.speed, abs(new.v[tip]) + abs(new.v[tip + 1])),
        force=max(totals.force, force[1]),
    )
