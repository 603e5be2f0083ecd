"""The scene's tables, as TOML writes them. All quantities are SI.

The tables of finger, material, surface, tip and drive are declared here, with the bounds of what a
scene may be. Those of the solvers follow from the settings that the solvers declare themselves.
"""

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import Annotated, Any, Literal, Self, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    create_model,
    model_validator,
)
from pydantic_core import PydanticCustomError

from validation.scenes.quantity import OrTable, Quantity, Rows

Numbers = float | tuple[float, ...]

MAX_TIMES = 10_000  # of a drive, each of which ends a step
LONGEST_M = 2.0  # above this a length of a finger was most likely meant in millimetres
MAX_TOTAL_ELEMENTS = 20_000  # above this a planar beam model is no longer a reduced one

ELEMENTS = 20  # in a phalanx, where neither they nor an accuracy are stated
ELEMENTS_ADVICE = "the paper uses 5 to 20 per phalanx, and 20 is converged to 0.02 %"
METRES_ADVICE = "write metres, not millimetres"
HEIGHT_ADVICE = (
    "the surface lies at Y = -height below the hinge: with height <= 0 it would be above the finger"
)
INCLINE_ADVICE = "20 degrees are 0.349 rad; a surface that hangs over takes drive.gravity < 0"
RELAXATION_ADVICE = (
    "write seconds: a vibration of frequency f has the share pi f tau of critical damping"
)
ACCURACY_ADVICE = "1e-3 is 0.1 %"
POISSON_ADVICE = "0.5 is incompressible and has no finite bulk modulus: use 0.49 or less"

COMPLIANCE = Quantity(at_least=-10, at_most=10)
# below a nanometre no continuum is left, and the section's second moment underflows
SIZE = Quantity("m", at_least=1e-9, at_most=LONGEST_M, per_phalanx=True, advice=METRES_ADVICE)


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

    phalanges: Annotated[int, Quantity(integer=True, at_least=1, at_most=200)] = 3
    """Number of phalanges, from the fixed hinge to the tip."""
    length: Annotated[Numbers, SIZE]
    """Between hinges; the last one's to the end of its half-ball."""
    diameter: Annotated[Numbers, SIZE]
    """Of the round section."""
    elements: Annotated[
        int | tuple[int, ...] | None,
        Quantity(
            integer=True, at_least=1, at_most=10**12, per_phalanx=True, advice=ELEMENTS_ADVICE
        ),
    ] = None
    """Beam elements of the reduced model in a phalanx; left out: what an accuracy asks for, else
    20."""


class MaterialTable(Table):
    """Linear elastic, isotropic, and damped if a relaxation time is given."""

    youngs_modulus: Annotated[Numbers, Quantity("Pa", at_least=1, at_most=1e14, per_phalanx=True)]
    """E."""
    density: Annotated[Numbers, Quantity("kg/m3", at_least=1e-6, at_most=1e6, per_phalanx=True)]
    """rho."""
    poisson_ratio: Annotated[
        Numbers, Quantity(at_least=0, below=0.5, per_phalanx=True, advice=POISSON_ADVICE)
    ]
    """nu; of the finite elements, of the refined reduced model, and of the default of
    tip.tangential_ratio."""
    relaxation_time: Annotated[
        Numbers,
        Quantity("s", at_least=0, at_most=1, per_phalanx=True, advice=RELAXATION_ADVICE),
    ] = 0.0
    """tau of Kelvin and Voigt's damping, stress by the strain + tau times its rate; 0: none."""


class SurfaceTable(Table):
    """The rigid plane Y = -height with Coulomb friction."""

    height: Annotated[float, Quantity("m", above=0, at_most=1e4, advice=HEIGHT_ADVICE)]
    """Depth of the surface Y = -height below the fixed hinge."""
    friction: Annotated[
        float, Quantity(at_least=0, at_most=100, advice="use 0 for a smooth surface")
    ]
    """mu, Coulomb's coefficient."""
    incline: Annotated[
        float, Quantity("rad", at_least=-math.pi / 2, at_most=math.pi / 2, advice=INCLINE_ADVICE)
    ] = 0.0
    """Angle by which the surface rises towards +X. X runs along it and Y is its normal, so that
    start.angles count from the surface: -incline is horizontal."""


class TipTable(Table):
    """The reduced model's lumped contact (the solid models resolve the contact instead)."""

    normal_stiffness: Annotated[float, Quantity("N/m", above=0, at_most=1e14)]
    """k, slope of the normal element while it is compressed."""
    restitution: Annotated[
        float, Quantity(above=0, at_most=1, advice="1 returns all of the energy")
    ] = 1.0
    """e*, energetic coefficient."""
    tangential_ratio: Annotated[float | None, Quantity(at_least=0, at_most=1e6)] = None
    """eta^-2, tangential over normal stiffness; by default Mindlin's 2(1 - nu)/(2 - nu)."""
    compliance_nn: Annotated[float | None, COMPLIANCE] = None
    """E R c_nn, of the tip's own compliance where solver.hcm.tip_compliance takes it into account:
    between the beam's end and the contact; by default, and likewise, its closed form."""
    compliance_nt: Annotated[float | None, COMPLIANCE] = None
    """E R c_nt, normal yielding of a tangential force away from the hinges."""
    compliance_tt: Annotated[float | None, COMPLIANCE] = None
    """E R c_tt over the cosine of the last phalanx's angle from the vertical."""


TORQUES = Quantity("N m", at_least=-1e6, at_most=1e6, only_list=True)


class TorqueTable(Table):
    """Joint torques over time: linear between its times, held before the first and after the last.

    Two equal times are a jump.
    """

    time: Annotated[
        tuple[float, ...], Quantity("s", at_least=0, at_most=1e9, only_list=True, per="time")
    ]
    """Times, rising."""
    values: Annotated[tuple[tuple[float, ...], ...], Rows(TORQUES)]
    """A row of torques for each time, with one number per phalanx."""

    @model_validator(mode="after")
    def _rows_at_rising_times(self) -> Self:
        key = "drive.torques.time"
        if len(self.time) != len(self.values):
            text = f"has {len(self.time)} times for {len(self.values)} rows of values; give as many"
            raise _refuse(key, list(self.time), text)
        if len(self.time) > MAX_TIMES:
            text = f"has {len(self.time)} times: at most {MAX_TIMES} are allowed; leave some out"
            raise _refuse(key, list(self.time[:3]), text)
        for first, second, third in zip(
            (-1.0, *self.time), self.time, (*self.time[1:], math.inf), strict=False
        ):
            if second < first or first == second == third:
                text = f"must rise, and {second:g} s does not; two equal times are a jump"
                raise _refuse(key, list(self.time), text)
        return self


class DriveTable(Table):
    """Joint torques (counter-clockwise positive) and gravity."""

    torques: Annotated[
        tuple[float, ...] | TorqueTable | None, OrTable(**vars(TORQUES), table=TorqueTable)
    ] = None
    """tau_w of each phalanx, counter-clockwise positive, on its first node: a list with one number
    per phalanx, or a table of such lists over time, [drive.torques] time and values."""
    gravity: Annotated[float, Quantity("m/s2", at_least=-1e4, at_most=1e4)] = 9.8
    """g, downwards: along -Y where surface.incline is 0."""
    reaction: bool = False
    """Whether a torque reacts on the previous phalanx, as a motor in the hinge does."""


class StartTable(Table):
    """Where the motion starts; left out: along -X, parallel to the surface, at rest."""

    angles: Annotated[
        Numbers | None, Quantity("rad", at_least=-math.pi, at_most=math.pi, per_phalanx=True)
    ] = None
    """theta_w from -X, counter-clockwise: downwards is positive."""
    rates: Annotated[
        Numbers | None, Quantity("rad/s", at_least=-1e6, at_most=1e6, per_phalanx=True)
    ] = None
    """omega_w, absolute."""


def _refuse(key: str, value: object, text: str) -> PydanticCustomError:
    return PydanticCustomError("scene", "{text}", {"text": text, "key": key, "value": value})


def _cost(elements: float) -> str:
    """Memory and time that the reduced model would need for so many elements."""
    from hcm.workload import ELEMENT_BYTES, SECONDS_A_STEP

    memory, step = ELEMENT_BYTES * elements / 2**30, SECONDS_A_STEP * elements
    return f"some {memory:.2g} GiB and {step:.2g} s a time step"


def _declared(settings: type, left_out: Iterable[str]) -> dict[str, Any]:
    """Keys of a solver's table, from the fields of its settings; None: the scene states nothing."""
    keys: dict[str, Any] = {}
    for field in dataclasses.fields(settings):
        if field.name in left_out:
            continue
        kind: Any = field.type
        members = get_args(kind)
        if get_origin(kind) is Annotated:
            number, bound = members
            kind = Annotated[number | None, Quantity(**vars(bound))]
        else:  # of names or an object of the solver's, a scene states a name
            kind = next((m for m in members if get_origin(m) is Literal), kind) | None
        keys[state_key(field.name)] = (kind, None)
    return keys


def state_key(field: str) -> str:
    """A scene's key is a field's name without the suffix of its unit."""
    return field.removesuffix("_s")


def settings_of(solver: str) -> dict[type, tuple[str, ...]]:
    """Settings of a solver, and which of their fields are no matter of a scene.

    Postures that a figure asks for, what is sampled, how refinement is aimed, and the guards.
    """
    if solver == "hcm":
        import hcm

        return {hcm.Settings: ("frame_times",), hcm.Assumptions: ()}
    import meshes
    import reference_fem

    return {reference_fem.Settings: OUTPUT, meshes.Sizing: LIMITS}


def _declared_by(solver: str) -> dict[str, Any]:
    kinds = settings_of(solver).items()
    return {key: kind for settings, out in kinds for key, kind in _declared(settings, out).items()}


class AccuracyTable(Table):
    """What may be asked of a solver in the place of its settings."""

    accuracy: Annotated[
        float | None, Quantity(at_least=1e-6, at_most=0.1, advice=ACCURACY_ADVICE)
    ] = None
    """Largest relative error wanted in peak force, impulse, duration and arrival, against the same
    model's converged answer; settings that are not stated follow from it."""


@cache
def hcm_table() -> type[Table]:
    """``[solver.hcm]``: the reduced model's settings."""
    return create_model("HcmTable", __base__=AccuracyTable, **_declared_by("hcm"))


class FemMeshTable(AccuracyTable):
    """The solid models' mesh: a preset gives sizes and contact law, other keys override it."""

    preset: Literal["contact", "fast", "ls-dyna-like", "converged"] = "contact"
    """Sizes of the mesh and contact law, scaled with the diameter."""
    symmetry: bool = True
    """Whether half of the body is meshed in 3D, cut by its plane of motion."""
    shaft_radius: Annotated[float | None, Quantity("m", above=0, at_most=LONGEST_M)] = None
    """Of the holes for shafts at the hinges, also those of a mesh file; left out: none, end faces
    turn about their axes."""
    mesh: str | None = None
    """Path of a mesh file, relative to the current folder, in place of the preset's mesh."""

    @model_validator(mode="after")
    def _mesh_or_sizes(self) -> Self:
        for key in ("section_size", "axial_size", "tip_size", "growth", "patch_size"):
            value = getattr(self, key)
            if self.mesh is not None and value is not None:
                key = f"solver.fem.{key}"
                text = "has no effect on a mesh that is read: leave it or solver.fem.mesh out"
                raise _refuse(key, value, text)
        return self


OUTPUT = ("lead_steps", "output_interval", "max_samples", "snapshots", "energy_tolerance")
LIMITS = ("contact_angle", "max_elements", "max_updates")


@cache
def fem_table() -> type[Table]:
    """``[solver.fem]``: the mesh's keys, the reference's settings and the mesh's sizes."""
    return create_model("FemTable", __base__=FemMeshTable, **_declared_by("fem"))


SOLVER_TABLES: dict[str, Callable[[], type[Table]]] = {"hcm": hcm_table, "fem": fem_table}


def _checked_by(table: Callable[[], type[Table]]) -> AfterValidator:
    def check(stated: dict[str, Any]) -> dict[str, Any]:
        table().model_validate(stated)
        return stated

    return AfterValidator(check)


class SolverTable(AccuracyTable):
    """What the scene states for each solver, checked by the bounds of that solver's settings.

    A solver's package, which takes a second to import, is imported where the scene states
    something for it or its table is read, not for a scene that the other one solves.
    """

    stated_hcm: Annotated[dict[str, Any], _checked_by(hcm_table)] = Field({}, alias="hcm")
    stated_fem: Annotated[dict[str, Any], _checked_by(fem_table)] = Field({}, alias="fem")

    @property
    def hcm(self) -> Any:
        """The `hcm_table` of this scene."""
        return hcm_table().model_validate(self.stated_hcm)

    @property
    def fem(self) -> Any:
        """The `fem_table` of this scene."""
        return fem_table().model_validate(self.stated_fem)

    def accuracy_of(self, solver: str) -> float | None:
        """What is asked of ``hcm`` or ``fem``: in its own table, or for all."""
        own = getattr(self, solver).accuracy
        return self.accuracy if own is None else own


class Scene(Table):
    """A finger, what it taps, what drives it, and how each model solves it."""

    finger: FingerTable
    material: MaterialTable
    surface: SurfaceTable
    tip: TipTable
    drive: DriveTable = DriveTable()
    start: StartTable = StartTable()
    solver: SolverTable = SolverTable.model_validate({})

    def per_phalanx(self, values: Numbers | tuple[int, ...]) -> tuple[float, ...]:
        """One number per phalanx, whether the scene gives one or a list."""
        if isinstance(values, tuple):
            return values
        return (values,) * self.finger.phalanges

    def rows(self, *columns: Numbers | tuple[int, ...]) -> Iterator[tuple[float, ...]]:
        """A row of numbers for each phalanx."""
        return zip(*map(self.per_phalanx, columns), strict=True)

    @property
    def elements(self) -> tuple[float, ...]:
        """Beam elements of each phalanx, those of no accuracy where none are stated."""
        return self.per_phalanx(self.finger.elements or ELEMENTS)

    @property
    def total_length(self) -> float:
        """Length of the stretched finger, m."""
        return sum(self.per_phalanx(self.finger.length))

    @property
    def start_state(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """Angles (rad) and rates (rad/s) of the phalanges at the start; None: horizontal, at rest.

        None lets a solver start as it does without being told, to the same bits.
        """
        if self.start == StartTable():
            return None
        angles, rates = (self.per_phalanx(v or 0.0) for v in (self.start.angles, self.start.rates))
        return angles, rates

    def _start_depth(self) -> float:
        """Of the finger's lowest point at the start below the fixed hinge, m.

        Hinges have sections of radius R_w. Of the tip the end of its axis counts: how low its round
        end reaches is a matter of the models.
        """
        angles, _ = self.start_state or ((0.0,) * self.finger.phalanges, ())
        depth, lowest = 0.0, 0.0
        for length, diameter, angle in self.rows(self.finger.length, self.finger.diameter, angles):
            section, before = 0.5 * diameter * abs(math.cos(angle)), depth
            depth += length * math.sin(angle)
            lowest = max(lowest, before + section, depth)
        return lowest

    @property
    def torque_rows(self) -> tuple[tuple[float, ...], ...]:
        """Joint torques, N m: one row, or one for each time of a table; none given means none."""
        torques = self.drive.torques
        if isinstance(torques, TorqueTable):
            return torques.values
        return (torques or (0.0,) * self.finger.phalanges,)

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
        for key, value in ((f"{t}.{name}", value) for t, table in self for name, value in table):
            if isinstance(value, tuple) and len(value) != count:  # every list is by phalanx
                raise _refuse(
                    key,
                    list(value),
                    f"has {len(value)} numbers for {count} phalanges; "
                    f"give {count}, or change finger.phalanges",
                )
        for row in self.torque_rows:
            if len(row) != count:
                raise _refuse(
                    "drive.torques.values",
                    list(row),
                    f"is a row of {len(row)} numbers for {count} phalanges; give {count}, or "
                    "change finger.phalanges",
                )
        elements = sum(self.elements)
        if elements > MAX_TOTAL_ELEMENTS:
            raise _refuse(
                "finger.elements",
                self.finger.elements,
                f"asks for {elements:.0f} beam elements, {_cost(elements)}: "
                f"at most {MAX_TOTAL_ELEMENTS} are allowed; {ELEMENTS_ADVICE}",
            )
        radii = [0.5 * d for d in self.per_phalanx(self.finger.diameter)]
        last = self.per_phalanx(self.finger.length)[-1]
        if last <= radii[-1]:
            raise _refuse(
                "finger.length",
                self.finger.length,
                f"leaves the last phalanx {last:g} m, no longer than its round end of "
                f"{radii[-1]:g} m: lengthen it, or reduce finger.diameter",
            )
        if self.surface.height <= (lowest := self._start_depth()):
            raise _refuse(
                "surface.height",
                self.surface.height,
                f"must be > {lowest:g}: at the start the finger reaches as low, and the surface "
                "would cut it",
            )
        if self.surface.height >= self.total_length:
            raise _refuse(
                "surface.height",
                self.surface.height,
                f"is never reached: the stretched finger is {self.total_length:g} m long; "
                f"set surface.height below {self.total_length:g} or lengthen finger.length",
            )
        return self
