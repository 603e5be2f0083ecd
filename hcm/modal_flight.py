"""A first flight in long steps, at whose end the vibration of its start is added as modes.

The elements start from the bent shape that their weight and inertia hold (`hcm.flight.vibration`):
from there they hardly vibrate, and bend slowly on their way. Near the touch their acceleration a is
constant, and the tip touches where q_s + v_s t + a t^2/2 and the vibration together first reach the
surface.
"""

import numpy as np
from numpy.polynomial.polynomial import polyval
from scipy.optimize import brentq

from hcm.arrays import Floats
from hcm.assembly.equations import fill_chords
from hcm.assembly.state import Motion
from hcm.beam.refinement import beams_of
from hcm.bounds import ParameterError
from hcm.flight.fall import Fall, rods_fall
from hcm.flight.vibration import Vibration, vibration
from hcm.model import Model, Scene, build_model, rods_state, until_touch
from hcm.parameters import GAUSS
from hcm.results.record import Segment
from hcm.results.status import Status
from hcm.start import Flown, first_contact, start_beams, write_first_row
from hcm.stepping import Progress, take_steps

# Most elements of a modal flight: eigenproblems of 200 take 3 s and 0.4 GB.
MOST_MODAL = 200
# The first touch is sought this many times as far from the bent tip's as the vibration reaches, at
# most this share of a step away, at so many times in a period of the fastest mode, and in all at
# least and at most at so many.
WIDER, SHARE, PER_PERIOD, FEWEST, MOST = 1.5, 0.1, 16, 16, 4096


def rings(scene: Scene) -> bool:
    """Whether a scene is released at rest, with neither torques nor damping."""
    state, _ = rods_state(scene.finger, scene.start)
    damped = any(phalanx.relaxation_time > 0.0 for phalanx in scene.finger.phalanges)
    loaded = scene.drive.has_torques or not scene.settings.consistent_start
    return not (loaded or damped or state[state.size // 2 :].any())


def fly_modal(scene: Scene, progress: Progress | None, fall: Fall | None) -> Flown:
    """The flight of a scene with the elements of the flight.

    fall : of this finger as rods, if known.

    Raises ParameterError: the scene's vibration is not that of a start at rest, or it has more
        elements than `MOST_MODAL`.
    """
    finger, assumptions = scene.finger, scene.assumptions
    if not rings(scene) or scene.settings.flight_integrator != GAUSS:
        raise ParameterError(
            "flight = 'modal': must be 'elastic' or 'rigid' for a finger with torques or a"
            " relaxation_time, for a start in motion, with consistent_start = False, and unless"
            " flight_integrator is 'gauss'"
        )
    if (count := sum(p.elements for p in finger.phalanges)) > MOST_MODAL:
        raise ParameterError(
            f"flight = 'modal': has {count} elements in flight, must have at most {MOST_MODAL};"
            " reduce flight_elements"
        )
    model = until_touch(build_model(scene), finger, assumptions)
    begun, fall = start_beams(model), fall or rods_fall(scene)
    motion, ringing, unknown = begun.motion, None, np.inf
    if fall is not None:
        lengths = np.array([p.length for p in beams_of(finger, assumptions).phalanges])
        law = model.generalized_alpha.law
        try:
            ringing = vibration(model.chain, law, lengths, fall.flight)
        except KeyboardInterrupt:
            return Flown(model, [begun.segment], motion, Status.INTERRUPTED)
        unknown = ringing.unknown / fall.speed
        motion.q[:] += ringing.bent
        fill_chords(motion.q, model.chain, motion.chords)
    taken = take_steps(model, begun, progress)
    segments = taken.segments
    if ringing is not None and segments[-1].events:
        segments = [*segments[:-1], _vibrating(model, segments[-1], motion, ringing)]
    return Flown(model, segments, motion, taken.status, unknown)


def _vibrating(model: Model, last: Segment, motion: Motion, ringing: Vibration) -> Segment:
    """Move `motion`, and the end of the history, to where the vibrating tip touches first."""
    chain, integrator, end = model.chain, model.generalized_alpha, last.totals.time
    a, down = motion.acceleration, chain.tip + 1
    path = np.array([motion.q[down] + integrator.law.height, motion.v[down], 0.5 * a[down]])
    near = SHARE * model.limits.flight_step
    time = _first_touch(end, near, path, down, ringing)
    since, (more_q, more_v) = time - end, ringing.at(time)
    motion.q[:] += since * (motion.v + 0.5 * since * a) + more_q
    motion.v[:] += since * a + more_v
    fill_chords(motion.q, chain, motion.chords)
    contact = first_contact(motion, chain.tip, integrator.law)
    totals = last.totals._replace(time=time, phase_start=time)
    # rows just before the touch lack what the vibration moves, by which velocities would jump
    kept = last.rows[:, 0] < time - near
    kept[-1] = True
    rows, reactions = last.rows[kept], last.reactions[kept]
    write_first_row(rows[-1], reactions[-1], True, motion, totals, contact, integrator, model.probe)
    return last._replace(contact=contact, totals=totals, rows=rows, reactions=reactions)


def _first_touch(end: float, most: float, path: Floats, down: int, ringing: Vibration) -> float:
    """When the tip's height first is zero, s; at most `most` from `end`, or there.

    path : (3,) coefficients of the height without vibration, m, in the time since `end`, s. down :
    place of the tip's height.
    """

    def height(since: Floats) -> Floats:
        above: Floats = polyval(since, path) + ringing.at(end + since)[0][..., down]
        return above

    furthest = float(np.abs(ringing.modes[:, down]).sum())
    reach = min(WIDER * furthest / max(abs(float(path[1])), 1e-300), most)
    periods = reach * float(ringing.frequency.max(initial=0.0)) / np.pi  # from -reach to reach
    times = np.linspace(-reach, reach, min(max(int(PER_PERIOD * periods), FEWEST), MOST))
    below = np.flatnonzero(height(times) <= 0.0)
    if not below.size or below[0] == 0:
        return end
    return end + float(brentq(height, times[below[0] - 1], times[below[0]], xtol=1e-16))
