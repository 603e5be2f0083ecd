"""The runs behind the paper's section 4, as changes of the built-in scenes.

Cases named after a figure are the paper's own; those named after an experiment change a choice that
the paper leaves open or makes coarsely, to find out why a number differs.

The numerics that the article states are xi = 0.8, steps of 1 ms in flight and 0.1 us in contact,
and a start from q.. = 0 (fig. 6). The times of fig. 13's postures (67.2, 9.1 and 6.7 ms in flight)
are not multiples of 1 ms; all nine are multiples of 0.02 ms, the longest flight step they allow.

The driven cases at the identified t_3 factor are accompanied by variations: the factor's
uncertainty, the factor from case 2's arrival alone (the time printed with most digits), a coarser
mesh, other steps, other tangential stiffnesses (the article gives none), and the article's numerics
with the factor identified under them.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from validation.studies.paper.case_runs import Case

Changes = Mapping[str, tuple[str, ...]]  # overrides by what is added to a case's name

_PAPER = (
    "solver.hcm.flight_tolerance=0.0",
    "solver.hcm.contact_step=1e-7",
    "solver.hcm.contact_tolerance=0.0",
    "solver.hcm.spectral_radius=0.8",
    "solver.hcm.consistent_start=false",
)
NUMERICS: Changes = {
    "0.02 ms steps": ("solver.hcm.flight_step=2e-5", *_PAPER),
    "printed steps": ("solver.hcm.flight_step=1e-3", *_PAPER),
}
# The settings of a scene without a [solver.hcm] table.
DEFAULTS = (
    "solver.hcm.flight_step=1e-4",
    "solver.hcm.flight_tolerance=1e-6",
    "solver.hcm.contact_step=1e-6",
    "solver.hcm.contact_tolerance=1e-11",
    "solver.hcm.spectral_radius=0.8",
)

COARSER: Changes = {"N=15": ("finger.elements=5",), "N=30": ("finger.elements=10",)}
FINER: Changes = {"N=120": ("finger.elements=40",)}
# Beside the soft scene's mu of 0.5, 1 GPa, slenderness L/sqrt(I/A) of 10.7, and Mindlin's 4/3.
FRICTIONS = (0.3, 0.7, 0.9, 1.1, 1.3)
COMPLIANCES: Changes = {
    "E=0.01 GPa": ("material.youngs_modulus=1e7",),
    "E=0.1 GPa": ("material.youngs_modulus=1e8",),
    "delta=32": ("finger.diameter=0.005",),
    "delta=16": ("finger.diameter=0.01",),
}
STIFFNESSES: Changes = {
    f"eta^2={eta2:g}": (f"tip.tangential_ratio={1 / eta2!r}",)
    for eta2 in (1.25, 1.4, 1.5, 1.52, 1.54, 1.56)
}
STRESS_VARIED: Changes = {**COARSER, **FINER, "printed steps": NUMERICS["printed steps"]}
SLENDEREST_VARIED: Changes = {
    "N=15": COARSER["N=15"],
    **FINER,
    "tolerance 1 nm": ("solver.hcm.contact_tolerance=1e-9",),
    "xi=0.5": ("solver.hcm.spectral_radius=0.5",),
}

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
OTHERS: Changes = {
    "N=15": COARSER["N=15"],
    "adaptive steps": DEFAULTS,
    **{name: STIFFNESSES[name] for name in ("eta^2=1.25", "eta^2=1.5")},
}
DRIVEN_VARIED = ("low", "high", "case 2 alone", *OTHERS, *NUMERICS)


def _changed(case: Case, changes: Changes) -> tuple[Case, ...]:
    """The case with each of these changes."""
    return tuple(
        replace(case, name=f"{case.name} {name}", overrides=(*case.overrides, *overrides))
        for name, overrides in changes.items()
    )


def friction_case(mu: float) -> str:
    """Name of the soft finger's case with this coefficient; its own is 0.5."""
    return "soft" if mu == 0.5 else f"soft mu={mu:g}"


def _with_friction(mu: float) -> Case:
    return Case(friction_case(mu), "soft", (f"surface.friction={mu!r}",))


def undriven_cases() -> tuple[Case, ...]:
    """The cases of sections 4.1 and 4.2."""
    hard, soft = (Case(scene, scene) for scene in ("hard", "soft"))
    restituting = Case("soft e*=0.8", "soft", ("tip.restitution=0.8",))
    return (
        *(hard, soft, *_changed(hard, COARSER), *_changed(soft, COARSER)),
        *map(_with_friction, FRICTIONS),
        *_changed(soft, COMPLIANCES),
        *(restituting, *_changed(restituting, COMPLIANCES)),
    )


def experiments() -> tuple[Case, ...]:
    """Cases that vary choices which the paper leaves open, one at a time."""
    slenderest = Case("soft delta=32", "soft", COMPLIANCES["delta=32"])
    return (
        *(case for mu in (0.9, 1.1, 1.3) for case in _changed(_with_friction(mu), STIFFNESSES)),
        *_changed(slenderest, SLENDEREST_VARIED),
        *(case for mu in (0.3, 0.7) for case in _changed(_with_friction(mu), STRESS_VARIED)),
    )


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


def driven_cases(
    factor: float, uncertainty: float, case_2_factor: float, fitted: Mapping[str, float]
) -> tuple[Case, ...]:
    """The cases of section 4.3; those without variations go on to the last posture of fig. 13.

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
    cases = []
    for scene in PRINTED_TORQUES:
        around = tuple(np.arange(*CONTACT_WINDOWS[scene], POSTURE_STEP).tolist())
        shown = POSTURE_TIMES[scene]
        end = f"solver.hcm.end_time={max(shown) * 1.001!r}"
        cases.append(driven(scene, factor, "", (end,), tuple(sorted({*shown, *around}))))
        cases += [driven(scene, own, label, changes, around) for label, own, changes in varied]
    return tuple(cases)
