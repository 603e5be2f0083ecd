"""The runs behind the paper's section 4, as changes of the built-in scenes.

Cases named after a figure are the paper's own; those named after an experiment change a choice that
the paper leaves open or makes coarsely, to find out why a number differs.
"""

from __future__ import annotations

from dataclasses import dataclass

FRICTIONS = (0.3, 0.7, 0.9, 1.1, 1.3)  # beside the soft scene's 0.5
MODULI = {"0.01": 1e7, "0.1": 1e8}  # GPa, beside the soft scene's 1
DIAMETERS = {"32": 0.005, "16": 0.01}  # slenderness L/sqrt(I/A), beside the soft scene's 10.7
PRINTED_TORQUES = {  # N m, N m, and the printed t_3 in its unknown unit
    "driven-1": (0.01, 0.008, 30.0),
    "driven-2": (1.0, 0.8, 3000.0),
    "driven-3": (1.0, 0.9, 5500.0),
}
POSTURE_TIMES: dict[
    str, tuple[float, ...]
] = {  # s, fig. 13's legends; the contact's own instant comes from the event
    "driven-1": (0.0, 0.0672, 0.09654),
    "driven-2": (0.0, 0.0091, 0.01308),
    "driven-3": (0.0, 0.0067, 0.0141),
}
PAPER_STEPS = (
    "solver.hcm.flight_step=1e-3",
    "solver.hcm.flight_tolerance=0.0",
    "solver.hcm.contact_step=1e-7",
    "solver.hcm.contact_tolerance=0.0",
    "solver.hcm.consistent_start=false",
)


@dataclass(frozen=True)
class Case:
    """One run of the reduced model: a built-in scene, overrides, and times of wanted postures."""

    name: str
    scene: str
    overrides: tuple[str, ...] = ()
    frame_times: tuple[float, ...] = ()


def torques(scene: str, factor: float) -> str:
    """The override that gives a driven scene its torques, t_3 being ``factor`` times its print."""
    t1, t2, t3 = PRINTED_TORQUES[scene]
    return f"drive.torques=[{t1}, {t2}, {t3 * factor!r}]"


def driven(scene: str, factor: float, label: str = "", extra: tuple[str, ...] = ()) -> Case:
    """A driven case with a t_3 factor and further overrides, to the end of its first tap."""
    return Case(f"{scene} {label}".strip(), scene, (torques(scene, factor), *extra))


def with_postures(scene: str, factor: float) -> Case:
    """A driven case that goes on after its first tap, to the last posture of fig. 13."""
    times = POSTURE_TIMES[scene]
    end = f"solver.hcm.end_time={max(times) * 1.001!r}"
    return Case(scene, scene, (torques(scene, factor), end), times)


def undriven_cases() -> tuple[Case, ...]:
    """Sections 4.1 and 4.2."""
    restituting = ("tip.restitution=0.8",)
    moduli = {f"E={n} GPa": (f"material.youngs_modulus={e!r}",) for n, e in MODULI.items()}
    diameters = {f"delta={n}": (f"finger.diameter={d!r}",) for n, d in DIAMETERS.items()}
    softer = {**moduli, **diameters}
    return (
        *(Case(scene, scene) for scene in ("hard", "soft")),
        *(
            Case(f"{scene} N={3 * n}", scene, (f"finger.elements={n}",))
            for scene in ("hard", "soft")
            for n in (5, 10)
        ),
        *(Case(f"soft mu={mu:g}", "soft", (f"surface.friction={mu!r}",)) for mu in FRICTIONS),
        *(Case(f"soft {name}", "soft", change) for name, change in softer.items()),
        Case("soft e*=0.8", "soft", restituting),
        *(
            Case(f"soft e*=0.8 {name}", "soft", change + restituting)
            for name, change in softer.items()
        ),
    )


def experiments() -> tuple[Case, ...]:
    """Choices that the paper leaves open, varied one at a time."""
    slender = (f"finger.diameter={DIAMETERS['32']!r}",)
    variations = {
        "N=15": "finger.elements=5",
        "N=120": "finger.elements=40",
        "tolerance 1 nm": "solver.hcm.contact_tolerance=1e-9",
        "xi=0.5": "solver.hcm.spectral_radius=0.5",
    }
    return (
        *(
            Case(f"soft mu={mu:g} eta^2={eta2:g}", "soft",
                 (f"surface.friction={mu!r}", f"tip.tangential_ratio={1 / eta2!r}"))
            for mu in (0.9, 1.1)
            for eta2 in (1.0, 1.5, 2.0)
        ),
        *(
            Case(f"soft delta=32 {name}", "soft", (*slender, change))
            for name, change in variations.items()
        ),
        Case("soft mu=0.3 N=15", "soft", ("surface.friction=0.3", "finger.elements=5")),
        Case("soft mu=0.7 N=15", "soft", ("surface.friction=0.7", "finger.elements=5")),
    )  # fmt: skip


def driven_cases(factor: float, uncertainty: float) -> tuple[Case, ...]:
    """Section 4.3 with the identified factor, its band, and the paper's own steps."""
    return tuple(
        case
        for scene in PRINTED_TORQUES
        for case in (
            with_postures(scene, factor),
            driven(scene, factor - uncertainty, "low"),
            driven(scene, factor + uncertainty, "high"),
            driven(scene, factor, "N=15", ("finger.elements=5",)),
            driven(scene, factor, "tolerance 1 um", ("solver.hcm.flight_tolerance=1e-6",)),
            driven(scene, factor, "xi=0.5", ("solver.hcm.spectral_radius=0.5",)),
            driven(scene, factor, "paper's steps", PAPER_STEPS),
        )
    )
