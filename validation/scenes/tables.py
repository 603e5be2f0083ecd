"""The scene's tables, as TOML writes them (design.md section 9). All quantities are SI."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, model_validator
from pydantic_core import PydanticCustomError

from validation.scenes.quantity import Quantity

Numbers = float | tuple[float, ...]

MAX_TOTAL_ELEMENTS = 20_000  # above this a planar beam model is no longer a reduced one

ELEMENTS_ADVICE = "the paper uses 5 to 20 per phalanx, and 20 is converged to 0.02 %"
HEIGHT_ADVICE = (
    "the surface lies at Y = -height below the hinge: with height <= 0 it would be above the finger"
)
POISSON_ADVICE = "0.5 is incompressible and has no finite bulk modulus: use 0.49 or less"


class Table(BaseModel):
    """A TOML table: frozen, and a key that it does not know is refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class FingerTable(Table):
    """Geometry: one number for all phalanges, or one per phalanx."""

    phalanges: Annotated[int, Quantity(integer=True, at_least=1, at_most=200)] = 3
    length: Annotated[Numbers, Quantity("m", above=0, at_most=100, per_phalanx=True)]
    diameter: Annotated[Numbers, Quantity("m", above=0, at_most=100, per_phalanx=True)]
    elements: Annotated[
        int | tuple[int, ...],
        Quantity(integer=True, at_least=1, per_phalanx=True, advice=ELEMENTS_ADVICE),
    ] = 20


class MaterialTable(Table):
    """Linear elastic, isotropic."""

    youngs_modulus: Annotated[Numbers, Quantity("Pa", at_least=1, at_most=1e14, per_phalanx=True)]
    density: Annotated[Numbers, Quantity("kg/m3", above=0, at_most=1e6, per_phalanx=True)]
    poisson_ratio: Annotated[
        Numbers, Quantity(at_least=0, below=0.5, per_phalanx=True, advice=POISSON_ADVICE)
    ]


class SurfaceTable(Table):
    """The rigid plane Y = -height with Coulomb friction."""

    height: Annotated[float, Quantity("m", above=0, at_most=1e4, advice=HEIGHT_ADVICE)]
    friction: Annotated[
        float, Quantity(at_least=0, at_most=100, advice="use 0 for a smooth surface")
    ]


class TipTable(Table):
    """The reduced model's lumped contact (the solid models resolve the contact instead)."""

    normal_stiffness: Annotated[float, Quantity("N/m", above=0, at_most=1e14)]
    restitution: Annotated[
        float, Quantity(above=0, at_most=1, advice="1 returns all of the energy")
    ] = 1.0
    tangential_ratio: Annotated[float | None, Quantity(at_least=0, at_most=1e6)] = None


class DriveTable(Table):
    """Joint torques (counter-clockwise positive) and gravity."""

    torques: Annotated[
        tuple[float, ...] | None,
        Quantity("N m", at_least=-1e6, at_most=1e6, only_list=True),
    ] = None
    gravity: Annotated[float, Quantity("m/s2", at_least=-1e4, at_most=1e4)] = 9.8
    reaction: bool = False


class HcmTable(Table):
    """Names are those of ``hcm.Settings``; what is absent keeps that class's default."""

    flight: Literal["elastic", "rigid"] | None = None
    flight_step: Annotated[float | None, Quantity("s", above=0, at_most=1)] = None
    flight_tolerance: Annotated[float | None, Quantity("m", at_least=0, at_most=1)] = None
    contact_step: Annotated[float | None, Quantity("s", above=0, at_most=1)] = None
    contact_tolerance: Annotated[float | None, Quantity("m", at_least=0, at_most=1)] = None
    spectral_radius: Annotated[float | None, Quantity(at_least=0, at_most=1)] = None
    newton_tolerance: Annotated[float | None, Quantity(at_least=1e-13, at_most=1e-3)] = None
    taps: Annotated[int | None, Quantity(integer=True, at_least=1, at_most=10_000)] = None
    end_time: Annotated[float | None, Quantity("s", above=0, at_most=1e4)] = None
    max_flight_time: Annotated[float | None, Quantity("s", above=0, at_most=1e4)] = None
    max_contact_time: Annotated[float | None, Quantity("s", above=0, at_most=1e4)] = None
    max_steps: Annotated[int | None, Quantity(integer=True, at_least=1, at_most=10**9)] = None
    consistent_start: bool | None = None
    reuse_factors: bool | None = None
    flight_integrator: Literal["generalized-alpha", "gauss"] | None = None
    repeat: bool | None = None


def _refuse(key: str, value: object, text: str) -> PydanticCustomError:
    return PydanticCustomError("scene", "{text}", {"text": text, "key": key, "value": value})


def _cost(elements: float) -> str:
    """Memory and time that the reduced model would need for so many elements."""
    from hcm.workload import ELEMENT_BYTES, SECONDS_A_STEP

    memory, step = ELEMENT_BYTES * elements / 2**30, SECONDS_A_STEP * elements
    return f"some {memory:.2g} GiB and {step:.2g} s a time step"


class FemTable(Table):
    """The solid models' settings: a preset gives defaults, other keys override it."""

    preset: Literal["fast", "ls-dyna-like", "converged"] = "fast"
    contact: Literal["penalty", "surface", "impulse"] | None = None
    surface_factor: Annotated[float | None, Quantity(above=0, at_most=1e6)] = None
    contact_damping: Annotated[float | None, Quantity(at_least=0, at_most=1)] = None
    penalty_factor: Annotated[float | None, Quantity(above=0, at_most=1000)] = None
    step_factor: Annotated[float | None, Quantity(above=0, at_most=2)] = None
    threads: Annotated[int | None, Quantity(integer=True, at_least=1, at_most=1024)] = None
    element: str | None = None
    flight: Literal["rigid", "explicit"] | None = None
    symmetry: bool = True
    end_time: Annotated[float | None, Quantity("s", above=0, at_most=1e4)] = None
    max_flight_time: Annotated[float | None, Quantity("s", above=0, at_most=1e4)] = None
    max_contact_time: Annotated[float | None, Quantity("s", above=0, at_most=1e4)] = None
    max_steps: Annotated[int | None, Quantity(integer=True, at_least=1, at_most=10**9)] = None
    section_size: Annotated[float | None, Quantity("m", at_least=1e-6, at_most=100)] = None
    axial_size: Annotated[float | None, Quantity("m", at_least=1e-6, at_most=100)] = None
    tip_size: Annotated[float | None, Quantity("m", at_least=1e-6, at_most=100)] = None
    growth: Annotated[float | None, Quantity(above=1, at_most=2)] = None
    shaft_radius: Annotated[float | None, Quantity("m", above=0, at_most=100)] = None
    mesh: str | None = None

    @model_validator(mode="after")
    def _mesh_or_sizes(self) -> Self:
        for key in ("section_size", "axial_size", "tip_size", "growth", "shaft_radius"):
            value = getattr(self, key)
            if self.mesh is not None and value is not None:
                key = f"solver.fem.{key}"
                text = "has no effect on a mesh that is read: leave it or solver.fem.mesh out"
                raise _refuse(key, value, text)
        return self


class SolverTable(Table):
    """One table per model."""

    hcm: HcmTable = HcmTable()
    fem: FemTable = FemTable()


class Scene(Table):
    """A finger, what it taps, what drives it, and how each model solves it."""

    finger: FingerTable
    material: MaterialTable
    surface: SurfaceTable
    tip: TipTable
    drive: DriveTable = DriveTable()
    solver: SolverTable = SolverTable()

    def per_phalanx(self, values: Numbers | tuple[int, ...]) -> tuple[float, ...]:
        """One number per phalanx, whether the scene gives one or a list."""
        if isinstance(values, tuple):
            return values
        return (values,) * self.finger.phalanges

    @property
    def total_length(self) -> float:
        """Length of the stretched finger, m."""
        return sum(self.per_phalanx(self.finger.length))

    @property
    def torques(self) -> tuple[float, ...]:
        """Joint torques, N m; none given means none acting."""
        return self.drive.torques or (0.0,) * self.finger.phalanges

    @property
    def tangential_ratio(self) -> float:
        """Tangential over normal stiffness eta^-2, by default Mindlin's 2(1 - nu)/(2 - nu)."""
        if self.tip.tangential_ratio is not None:
            return self.tip.tangential_ratio
        nu = self.per_phalanx(self.material.poisson_ratio)[-1]
        return 2 * (1 - nu) / (2 - nu)

    @model_validator(mode="after")
    def _tables_fit_together(self) -> Self:
        count = self.finger.phalanges
        listed = {
            "finger.length": self.finger.length,
            "finger.diameter": self.finger.diameter,
            "finger.elements": self.finger.elements,
            "material.youngs_modulus": self.material.youngs_modulus,
            "material.density": self.material.density,
            "material.poisson_ratio": self.material.poisson_ratio,
            "drive.torques": self.drive.torques,
        }
        for key, value in listed.items():
            if isinstance(value, tuple) and len(value) != count:
                raise _refuse(
                    key,
                    list(value),
                    f"has {len(value)} numbers for {count} phalanges; "
                    f"give {count}, or change finger.phalanges",
                )
        elements = sum(self.per_phalanx(self.finger.elements))
        if elements > MAX_TOTAL_ELEMENTS:
            raise _refuse(
                "finger.elements",
                self.finger.elements,
                f"asks for {elements:.0f} beam elements, {_cost(elements)}: "
                f"at most {MAX_TOTAL_ELEMENTS} are allowed; {ELEMENTS_ADVICE}",
            )
        if self.surface.height >= self.total_length:
            raise _refuse(
                "surface.height",
                self.surface.height,
                f"is never reached: the stretched finger is {self.total_length:g} m long; "
                f"set surface.height below {self.total_length:g} or lengthen finger.length",
            )
        return self
