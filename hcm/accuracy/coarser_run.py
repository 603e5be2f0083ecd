"""Judge a run by a coarser one, whose errors are `COMPANION_ERROR_RATIO` times as large, or more.

Errors of steps in contact go with h^2, of a followed vibration with h^(3/2) and at least l^4
(`hcm.accuracy.chosen_flight`), of elements in contact with l^4, of refined ones with l^2. The two
runs then differ by at least (ratio - 1) times the finer one's error; `SAFETY` covers errors that
fall more slowly with h and l.
A phalanx of one element, or of no more than the other run's flight needs, has twice as many in it,
whose error is at most a quarter of the run's: they differ by at least three quarters of that.
"""

import math
from dataclasses import replace

from hcm.accuracy.chosen import SMALLEST, STATED, Chosen
from hcm.estimates.companion import lost_energy, repetition_settings
from hcm.estimates.error_cautions import caution, later_taps, relative_errors, tap_peaks
from hcm.estimates.estimate import USABLE_STATUSES, companion_errors
from hcm.flight.fall import bending_wave_stress, magnified, omitted_time
from hcm.model import Scene
from hcm.parameters import GAUSS, Finger
from hcm.results.result import Errors, TapResult

COMPANION_ERROR_RATIO, SAFETY = 3.0, 1.5
# Factor on the step of a flight that does not follow its vibration: with equal steps both runs have
# it in the same wrong phase, and a tap that fades out, 1 % too short, would seem known to 0.03 %.
OTHER_PHASE = 0.8
ACCURACY_QUANTITIES = (
    "peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s", "contact_time_s",
)  # fmt: skip
"""Fields of the summary whose relative errors an accuracy bounds."""
RESOLVING = (
    "elements", "flight_elements", "flight_step", "flight_tolerance", "contact_step",
    "contact_tolerance",
)  # fmt: skip
"""Settings that bound a run's errors."""
TRANSITION_COUNTS = ("compression_to_restitution", "stick_to_slip", "slip_to_stick")


def coarser_scene(chosen: Chosen, own: TapResult) -> Scene:
    """Scene of the coarser run that judges `own`, over as many taps.

    In contact, and in a vibration that is followed, its error is `COMPANION_ERROR_RATIO` times as
    large. As many elements would tell nothing of their errors: twice as many do. Gauss's few steps
    in flight leave hardly any error but the phase of a vibration that they do not follow: it
    differs here (`OTHER_PHASE`).
    """
    scene, settings = chosen.scene, chosen.scene.settings
    longer, flown, kept, ratio = 1.0, settings.flight_elements, 1, COMPANION_ERROR_RATIO
    if chosen.followed:
        longer = OTHER_PHASE if settings.flight == "modal" else ratio ** (2 / 3)
        most = max(p.elements for p in scene.finger.phalanges)
        flown = _fewer(min(flown, most), ratio**0.25)
        kept = flown  # no phalanx has more elements in flight than in contact
    elif settings.flight == "elastic":
        longer = OTHER_PHASE if settings.flight_integrator == GAUSS else math.sqrt(ratio)
    others = []
    for p in scene.finger.phalanges:
        fewer = max(_fewer(p.elements, math.sqrt(ratio)), min(p.elements, kept))
        others.append(replace(p, elements=2 * fewer if fewer == p.elements else fewer))
    coarse = repetition_settings(
        settings,
        own,
        flight_elements=flown,
        flight_step=min(longer * settings.flight_step, 1.0),
        flight_tolerance=min(ratio * settings.flight_tolerance, 1.0),
        contact_step=min(math.sqrt(ratio) * settings.contact_step, 1.0),
        taps=max(tap_peaks(own).size, 1),
    )
    return replace(scene, finger=Finger(tuple(others)), settings=coarse)


def _fewer(elements: int, factor: float) -> int:
    """Elements over `factor`, rounded, and at least one fewer; 1 becomes 2, 0 stays 0."""
    return 2 if elements == 1 else max(min(round(elements / factor), elements - 1), 0)


def compared(
    result: TapResult, coarse: TapResult, chosen: Chosen, accuracy: float
) -> tuple[TapResult, float]:
    """Return the run with its estimated errors, and its largest expected relative error."""
    left_out = chosen.flight_error if chosen.flight_error < math.inf else 0.0
    settings = chosen.scene.settings
    single = any(phalanx.elements == 1 for phalanx in chosen.scene.finger.phalanges)
    single |= chosen.followed and settings.flight_elements == 1
    over = 1.0 if single else COMPANION_ERROR_RATIO - 1
    last, its = (run.given["finger"].phalanges[-1].elements for run in (result, coarse))
    of_stress = 2.0 if single or its > last else 1.0
    bent = late = 0.0
    if settings.flight == "rigid" and (fall := chosen.fall):
        finger = chosen.scene.finger
        bent = bending_wave_stress(fall.ringing + fall.bending, finger.phalanges[-1])
        late = omitted_time(fall.largest / fall.speed, finger, fall.time)
    stated = stated_keys(chosen)
    if accuracy > SMALLEST:
        remedy = "ask for a smaller accuracy" + f" without stating {stated}" * bool(stated)
    else:
        remedy = f"leave out {stated}" if stated else f"{accuracy:g} is the smallest accuracy"
    # not estimated from two runs: `SAFETY`, which multiplies all errors below, does not apply
    omitted = bent / SAFETY, late / SAFETY
    apart_by = companion_errors(result, coarse, of_stress, left_out, *omitted)
    errors: Errors = {
        name: (SAFETY * e[0], SAFETY * e[1]) if isinstance(e, tuple) else SAFETY * e
        for name, e in apart_by.items()
    }
    cautions = (
        *result.cautions,
        *caution(relative_errors(result.summary, errors), settings, remedy),
        *later_taps(tap_peaks(result), tap_peaks(coarse)),
        *other_transitions(result, coarse, remedy),
        *(magnified(chosen.scene, chosen.fall) if chosen.fall else ()),
    )
    both = result.summary, coarse.summary
    pairs = [[getattr(of, name) for of in both] for name in ACCURACY_QUANTITIES]
    known = coarse.status in USABLE_STATUSES
    apart = [abs(its / own - 1.0) if known and its is not None else math.inf for own, its in pairs]
    late_share = late / max(result.summary.contact_time_s or 0.0, 1e-300)
    expected = max(SAFETY * max(apart) / over, 0.5 * lost_energy(result), left_out, late_share)
    return replace(result, errors=errors, cautions=cautions), expected


def stated_keys(chosen: Chosen) -> str:
    """The scene's keys that keep a run's errors as they are, whatever accuracy is asked for."""
    keys = [c.setting for c in chosen.choices if c.reason == STATED and c.setting in RESOLVING]
    return ", ".join(
        "finger.elements" if key == "elements" else f"solver.hcm.{key}" for key in keys
    )


def other_transitions(result: TapResult, coarse: TapResult, remedy: str) -> tuple[str, ...]:
    """Caution about the first tap's transitions if the coarser run has more or fewer of them."""
    both = result.summary, coarse.summary
    counts = [(name, *(getattr(of, name) for of in both)) for name in TRANSITION_COUNTS]
    apart = ", ".join(f"{name} {own} against {its}" for name, own, its in counts if own != its)
    caution = f"transitions are not resolved ({apart} in coarser steps); {remedy}"
    return (caution,) if apart else ()
