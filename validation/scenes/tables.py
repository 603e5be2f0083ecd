"""The scene's tables of finger, material, surface, tip, drive and start, as TOML writes them.

All quantities are SI, with the bounds of what a scene may be.
"""

import dataclasses
import math
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, model_validator
from pydantic_core import PydanticCustomError

from validation.scenes.scene_number import OrTable, Rows, SceneNumber

Numbers = float | tuple[float, ...]

MAX_TIMES = 10_000  # most times in a drive's table; each ends a step
LONGEST_M = 2.0  # above this a length of a finger was most likely meant in millimetres

ELEMENTS_ADVICE = "the paper uses 5 to 20 per phalanx, and 20 is converged to 0.02 %"
METRES_ADVICE = "write metres, not millimetres"
HEIGHT_ADVICE = (
    "the surface lies at Y = -height below the hinge: with height <= 0 it would be above the finger"
)
INCLINE_ADVICE = "20 degrees are 0.349 rad; a surface that hangs over takes drive.gravity < 0"
RELAXATION_ADVICE = (
    "write seconds: a vibration of frequency f has the share pi f tau of critical damping"
)
POISSON_ADVICE = "0.5 is incompressible and has no finite bulk modulus: use 0.49 or less"

COMPLIANCE = SceneNumber(at_least=-10, at_most=10)
# below a nanometre there is no continuum, and the section's second moment underflows
SIZE = SceneNumber("m", at_least=1e-9, at_most=LONGEST_M, per_phalanx=True, advice=METRES_ADVICE)


def refuse(key: str, value: object, text: str) -> PydanticCustomError:
    """The error for pydantic if tables do not fit together: a key, its value, what to do."""
    return PydanticCustomError("scene", "{text}", {"text": text, "key": key, "value": value})


def state_key(field: str) -> str:
    """A scene's key for a field: its name without the suffix of its unit."""
    return field.removesuffix("_s")


class Table(BaseModel):
    """A TOML table: frozen, and a key that it does not know is refused."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True
    )

    def stated(self, settings: type) -> dict[str, Any]:
        """The fields of a solver's settings that the scene states; others keep their defaults."""
        values = {
            f.name: getattr(self, state_key(f.name), None) for f in dataclasses.fields(settings)
        }
        return {name: value for name, value in values.items() if value is not None}


class FingerTable(Table):
    """Geometry: one number for all phalanges, or one per phalanx."""

    phalanges: Annotated[int, SceneNumber(integer=True, at_least=1, at_most=200)] = 3
    """Number of phalanges, from the fixed hinge to the tip."""
    length: Annotated[Numbers, SIZE]
    """Length between hinges; the last one's includes its half-ball."""
    diameter: Annotated[Numbers, SIZE]
    """Diameter of the round section."""
    elements: Annotated[
        int | tuple[int, ...] | None,
        SceneNumber(
            integer=True, at_least=1, at_most=10**12, per_phalanx=True, advice=ELEMENTS_ADVICE
        ),
    ] = None
    """Beam elements of the reduced model per phalanx; left out: as an accuracy needs, else 20."""


class MaterialTable(Table):
    """Isotropic, Hooke's at small strains, and damped if a relaxation time is given."""

    youngs_modulus: Annotated[
        Numbers, SceneNumber("Pa", at_least=1, at_most=1e14, per_phalanx=True)
    ]
    """E."""
    density: Annotated[Numbers, SceneNumber("kg/m3", at_least=1e-6, at_most=1e6, per_phalanx=True)]
    """rho."""
    poisson_ratio: Annotated[
        Numbers, SceneNumber(at_least=0, below=0.5, per_phalanx=True, advice=POISSON_ADVICE)
    ]
    """nu, for the finite elements, the refined reduced model, and the default of
    tip.tangential_ratio."""
    relaxation_time: Annotated[
        Numbers | None,
        SceneNumber("s", at_least=0, at_most=1, per_phalanx=True, advice=RELAXATION_ADVICE),
    ] = None
    """tau of Kelvin-Voigt damping, stress by the strain + tau times its rate; 0: none. Left out:
    none, but that solids held to an accuracy have one near the touch where the tip slides."""
    law: Literal["saint-venant-kirchhoff", "neo-hooke"] = "saint-venant-kirchhoff"
    """Stress at finite strain, for fem3d and the tip of the refined reduced model; fem2d has the
    default alone, the paper's model none. Crushed, St. Venant-Kirchhoff's law softens; a
    neo-Hookean body, such as a silicone, stiffens."""


class SurfaceTable(Table):
    """The rigid plane Y = -height with Coulomb friction."""

    height: Annotated[float, SceneNumber("m", above=0, at_most=1e4, advice=HEIGHT_ADVICE)]
    """Depth of the surface Y = -height below the fixed hinge."""
    friction: Annotated[
        float, SceneNumber(at_least=0, at_most=100, advice="use 0 for a smooth surface")
    ]
    """mu, Coulomb's coefficient."""
    incline: Annotated[
        float, SceneNumber("rad", at_least=-math.pi / 2, at_most=math.pi / 2, advice=INCLINE_ADVICE)
    ] = 0.0
    """Angle by which the surface rises towards +X. X runs along it and Y is its normal, so that
    start.angles count from the surface: -incline is horizontal."""


class TipTable(Table):
    """The reduced model's lumped contact (the solid models resolve the contact instead)."""

    normal_stiffness: Annotated[float | None, SceneNumber("N/m", above=0, at_most=1e14)] = None
    """k, slope of the normal element while it is compressed. Needed where no partial slip is
    assumed, as hcm-refined does: its contact follows from E and nu."""
    restitution: Annotated[
        float, SceneNumber(at_least=1e-3, at_most=1, advice="1 returns all of the energy")
    ] = 1.0
    """e*, energetic coefficient."""
    tangential_ratio: Annotated[float | None, SceneNumber(at_least=0, at_most=1e6)] = None
    """eta^-2, tangential over normal stiffness; by default Mindlin's 2(1 - nu)/(2 - nu), which
    hcm-refined always has (partial slip)."""
    compliance_nn: Annotated[float | None, COMPLIANCE] = None
    """E R c_nn of the tip's own compliance, between beam's end and contact, where
    solver.hcm.tip_compliance uses it; by default, like the next two, its closed form."""
    compliance_nt: Annotated[float | None, COMPLIANCE] = None
    """E R c_nt, normal compliance to a tangential force away from the hinges."""
    compliance_tt: Annotated[float | None, COMPLIANCE] = None
    """E R c_tt over the cosine of the last phalanx's angle from the vertical."""


TORQUES = SceneNumber("N m", at_least=-1e6, at_most=1e6, only_list=True)


class TorqueTable(Table):
    """Joint torques over time: linear between its times, held before the first and after the last.

    Two equal times are a jump.
    """

    time: Annotated[
        tuple[float, ...], SceneNumber("s", at_least=0, at_most=1e9, only_list=True, per="time")
    ]
    """Times, rising."""
    values: Annotated[tuple[tuple[float, ...], ...], Rows(TORQUES)]
    """A row of torques for each time, with one number per phalanx."""

    @model_validator(mode="after")
    def _rows_at_rising_times(self) -> Self:
        key = "drive.torques.time"
        if len(self.time) != len(self.values):
            text = (
                f"has {len(self.time)} times for {len(self.values)} rows of values; give one time"
                " per row"
            )
            raise refuse(key, list(self.time), text)
        if len(self.time) > MAX_TIMES:
            text = f"has {len(self.time)} times: at most {MAX_TIMES} are allowed; leave some out"
            raise refuse(key, list(self.time[:3]), text)
        for first, second, third in zip(
            (-1.0, *self.time), self.time, (*self.time[1:], math.inf), strict=False
        ):
            if second < first or first == second == third:
                text = f"must rise, and {second:g} s does not; two equal times are a jump"
                raise refuse(key, list(self.time), text)
        return self


class DriveTable(Table):
    """Joint torques (counter-clockwise positive) and gravity."""

    torques: Annotated[
        tuple[float, ...] | TorqueTable | None, OrTable(**vars(TORQUES), table=TorqueTable)
    ] = None
    """tau_w on the first node of each phalanx, counter-clockwise positive: a list with one number
    per phalanx, or a table of such lists over time, [drive.torques] time and values."""
    gravity: Annotated[float, SceneNumber("m/s2", at_least=-1e4, at_most=1e4)] = 9.8
    """g, downwards: along -Y where surface.incline is 0."""
    reaction: bool = False
    """Whether a torque reacts on the previous phalanx, as a motor in the hinge does."""


class StartTable(Table):
    """Where the motion starts; left out: along -X, parallel to the surface, at rest."""

    angles: Annotated[
        Numbers | None, SceneNumber("rad", at_least=-math.pi, at_most=math.pi, per_phalanx=True)
    ] = None
    """theta_w from -X, counter-clockwise: downwards is positive."""
    rates: Annotated[
        Numbers | None, SceneNumber("rad/s", at_least=-1e6, at_most=1e6, per_phalanx=True)
    ] = None
    """omega_w, absolute."""
