"""The runs behind section 4.3: driven cases 1 to 3 with a factor on the printed t_3.

Each case at the identified factor is accompanied by variations: the factor's uncertainty, the
factor from case 2's arrival alone (the time printed with most digits), a coarser mesh, other steps,
other tangential stiffnesses (the article gives none), and the article's numerics with the factor
identified under them.
"""

from collections.abc import Mapping

import numpy as np

from validation.studies.paper.cases import DEFAULTS, POSTURE_GRID, PRINTED, Case

PRINTED_TORQUES = {  # N m, N m, and the printed t_3 in its unknown unit
    "driven-1": (0.01, 0.008, 30.0),
    "driven-2": (1.0, 0.8, 3000.0),
    "driven-3": (1.0, 0.9, 5500.0),
}
# s, fig. 13's legends; the contact's own instant comes from the event
POSTURE_TIMES: dict[str, tuple[float, ...]] = {
    "driven-1": (0.0, 0.0672, 0.09654),
    "driven-2": (0.0, 0.0091, 0.01308),
    "driven-3": (0.0, 0.0067, 0.0141),
}
# s: postures are kept from before the earliest to after the latest contact of all variations,
# closely enough for the largest deflection.
CONTACT_WINDOWS = {
    "driven-1": (0.0908, 0.0934),
    "driven-2": (0.0118, 0.0138),
    "driven-3": (0.0104, 0.0136),
}
POSTURE_STEP = 1e-5
NUMERICS = {"0.02 ms steps": POSTURE_GRID, "printed steps": PRINTED}
OTHERS = {
    "N=15": ("finger.elements=5",),
    "adaptive steps": DEFAULTS,
    **{f"eta^2={eta2:g}": (f"tip.tangential_ratio={1 / eta2!r}",) for eta2 in (1.25, 1.5)},
}
VARIED = ("low", "high", "case 2 alone", *OTHERS, *NUMERICS)


def torques(scene: str, factor: float) -> str:
    """The override with a driven scene's torques, t_3 being ``factor`` times the printed value."""
    t1, t2, t3 = PRINTED_TORQUES[scene]
    return f"drive.torques=[{t1}, {t2}, {t3 * factor!r}]"


def driven(
    scene: str,
    factor: float,
    label: str = "",
    extra: tuple[str, ...] = (),
    times: tuple[float, ...] = (),
) -> Case:
    """A driven case with a t_3 factor and further overrides, to the end of its first tap."""
    return Case(f"{scene} {label}".strip(), scene, (torques(scene, factor), *extra), times)


def contact_times(scene: str) -> tuple[float, ...]:
    """Times of the postures that are kept around the contact, s."""
    return tuple(np.arange(*CONTACT_WINDOWS[scene], POSTURE_STEP).tolist())


def with_postures(scene: str, factor: float) -> Case:
    """A driven case that goes on after its first tap, to the last posture of fig. 13."""
    times = tuple(sorted({*POSTURE_TIMES[scene], *contact_times(scene)}))
    end = f"solver.hcm.end_time={max(POSTURE_TIMES[scene]) * 1.001!r}"
    return driven(scene, factor, "", (end,), times)


def driven_cases(
    factor: float, uncertainty: float, case_2_factor: float, fitted: Mapping[str, float]
) -> tuple[Case, ...]:
    """The cases of section 4.3.

    factor, uncertainty : the identified t_3 factor, N m per printed unit.
    case_2_factor : the factor with which case 2 arrives at its printed time.
    fitted : the factor identified under each of ``NUMERICS``.
    """
    varied = (
        ("low", factor - uncertainty, ()),
        ("high", factor + uncertainty, ()),
        ("case 2 alone", case_2_factor, ()),
        *((label, factor, changes) for label, changes in OTHERS.items()),
        *((label, fitted[label], changes) for label, changes in NUMERICS.items()),
    )
    return tuple(
        case
        for scene in PRINTED_TORQUES
        for case in (
            with_postures(scene, factor),
            *(
                driven(scene, value, label, changes, contact_times(scene))
                for label, value, changes in varied
            ),
        )
    )
