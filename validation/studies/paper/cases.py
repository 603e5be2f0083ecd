"""The runs behind the paper's sections 4.1 and 4.2, as changes of the built-in scenes.

Cases named after a figure are the paper's own; those named after an experiment change a choice that
the paper leaves open or makes coarsely, to find out why a number differs.

The numerics that the article states are xi = 0.8, steps of 1 ms in flight and 0.1 us in contact,
and a start from q.. = 0 (fig. 6). The times of fig. 13's postures (67.2, 9.1 and 6.7 ms in flight)
are not multiples of 1 ms; all nine are multiples of 0.02 ms, the longest flight step they allow.
"""

from dataclasses import dataclass

_PAPER = (
    "solver.hcm.flight_tolerance=0.0",
    "solver.hcm.contact_step=1e-7",
    "solver.hcm.contact_tolerance=0.0",
    "solver.hcm.spectral_radius=0.8",
    "solver.hcm.consistent_start=false",
)
PRINTED = ("solver.hcm.flight_step=1e-3", *_PAPER)
POSTURE_GRID = ("solver.hcm.flight_step=2e-5", *_PAPER)
# The settings of a scene without a [solver.hcm] table.
DEFAULTS = (
    "solver.hcm.flight_step=1e-4",
    "solver.hcm.flight_tolerance=1e-6",
    "solver.hcm.contact_step=1e-6",
    "solver.hcm.contact_tolerance=1e-11",
    "solver.hcm.spectral_radius=0.8",
)

FRICTIONS = (0.3, 0.7, 0.9, 1.1, 1.3)  # beside the soft scene's 0.5
MODULI = {"0.01": 1e7, "0.1": 1e8}  # GPa, beside the soft scene's 1
ETA2 = (1.25, 1.4, 1.5, 1.52, 1.54, 1.56)  # beside Mindlin's 4/3
DIAMETERS = {"32": 0.005, "16": 0.01}  # slenderness L/sqrt(I/A), beside the soft scene's 10.7
STRESS_VARIED = {
    "N=15": ("finger.elements=5",),
    "N=30": ("finger.elements=10",),
    "N=120": ("finger.elements=40",),
    "printed steps": PRINTED,
}


@dataclass(frozen=True)
class Case:
    """One run of the reduced model: a built-in scene, overrides, and times of wanted postures."""

    name: str
    scene: str
    overrides: tuple[str, ...] = ()
    frame_times: tuple[float, ...] = ()


def friction_case(mu: float) -> str:
    """Name of the soft finger's case with this coefficient; its own is 0.5."""
    return "soft" if mu == 0.5 else f"soft mu={mu:g}"


def undriven_cases() -> tuple[Case, ...]:
    """The cases of sections 4.1 and 4.2."""
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
        *(Case(friction_case(mu), "soft", (f"surface.friction={mu!r}",)) for mu in FRICTIONS),
        *(Case(f"soft {name}", "soft", change) for name, change in softer.items()),
        Case("soft e*=0.8", "soft", restituting),
        *(
            Case(f"soft e*=0.8 {name}", "soft", change + restituting)
            for name, change in softer.items()
        ),
    )


def experiments() -> tuple[Case, ...]:
    """Cases that vary choices which the paper leaves open, one at a time."""
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
            for mu in (0.9, 1.1, 1.3)
            for eta2 in ETA2
        ),
        *(
            Case(f"soft delta=32 {name}", "soft", (*slender, change))
            for name, change in variations.items()
        ),
        *(
            Case(f"soft mu={mu:g} {name}", "soft", (f"surface.friction={mu!r}", *changes))
            for mu in (0.3, 0.7)
            for name, changes in STRESS_VARIED.items()
        ),
    )  # fmt: skip
