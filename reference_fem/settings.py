"""Inputs of a run: materials, surface, drive and numerical settings (SI units).

Every class is frozen and checks itself when it is made: a ValueError names the key, its value, what
is allowed and what is usual.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np

from meshes.bounds import Bound, check_fields, check_number
from reference_fem.torques import Torques

Flight = Literal["rigid", "explicit", "coarse"]
Contact = Literal["penalty", "surface", "impulse"]
MaterialLaw = Literal["saint-venant-kirchhoff", "neo-hooke"]
ONE_POINT = "hex8-one-point"
"""The element in 3D that is not the default."""
SAINT_VENANT: Final = "saint-venant-kirchhoff"
NEO_HOOKE: Final = "neo-hooke"

LONGEST_S = 1e12
"""Bound on times: beyond it sums of steps lose their digits."""


@dataclass(frozen=True)
class Material:
    """An isotropic material, elastic or damped; one per phalanx."""

    youngs_modulus: Annotated[float, Bound("Pa", above=0)]
    """E."""
    poisson_ratio: Annotated[
        float,
        Bound(above=-1, below=0.5, advice="an incompressible body needs a value such as 0.49"),
    ]
    """ν."""
    density: Annotated[float, Bound("kg/m3", above=0)]
    """ρ of the undeformed body."""
    relaxation_time: Annotated[float, Bound("s", at_least=0, at_most=LONGEST_S)] = 0.0
    """τ of Kelvin-Voigt damping, S = C : (E + τ dE/dt); 0: none."""
    law: MaterialLaw = SAINT_VENANT
    """Stress at finite strain; the same for all phalanges. Crushed, St. Venant-Kirchhoff's law
    softens; a neo-Hookean body, such as a silicone, stiffens."""

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def bulk_modulus(self) -> float:
        """K = E / (3 (1 - 2ν)), Pa."""
        return self.youngs_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))

    @property
    def plane_strain_modulus(self) -> float:
        """E* = E/(1 - ν²), Pa: the effective modulus on a rigid plane (Hertz)."""
        return self.youngs_modulus / (1.0 - self.poisson_ratio**2)

    @property
    def bar_speed(self) -> float:
        """Speed of axial waves in a slender bar, sqrt(E/ρ), m/s."""
        return math.sqrt(self.youngs_modulus / self.density)


@dataclass(frozen=True)
class Surface:
    """The rigid plane Y = -height."""

    height: Annotated[float, Bound("m", above=0, advice="the surface lies at Y = -height")]
    """H."""
    friction: Annotated[float, Bound(at_least=0, advice="0 means a smooth surface")]
    """Coulomb's μ."""

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class TorqueTable:
    """Joint torques over time: linear between its times, held before the first and after the last.

    Two equal times are a jump.
    """

    time: Annotated[tuple[float, ...], Bound("s", at_least=0, at_most=LONGEST_S)]
    """(n,), s, never falling, at most two of them equal."""
    values: tuple[tuple[float, ...], ...]
    """(n, P), t_w in N·m."""

    def __post_init__(self) -> None:
        check_fields(self)
        if not isinstance(self.values, tuple) or not all(isinstance(v, tuple) for v in self.values):
            raise ValueError(f"torques.values = {self.values!r}: must be a tuple of tuples")
        if not self.time or len(self.time) != len(self.values):
            raise ValueError(
                f"torques: {len(self.time)} times and {len(self.values)} rows of values; give "
                "one time per row, at least one"
            )
        for torque in (torque for row in self.values for torque in row):
            check_number("torques.values", torque, Bound("N m"))
        steps = np.diff(self.time)
        if (steps < 0).any() or (steps[1:] + steps[:-1] == 0).any():
            raise ValueError(
                f"torques.time = {list(self.time)}: must rise; two times may be equal (a "
                "jump), not three"
            )


def check_materials(materials: Sequence[Material], phalanges: int) -> None:
    """Raise ValueError unless there is one per phalanx, and one law."""
    if len(materials) != phalanges:
        raise ValueError(
            f"materials: {len(materials)} given for {phalanges} phalanges; give one per phalanx"
        )
    if len({material.law for material in materials}) > 1:
        raise ValueError(f"law = {[m.law for m in materials]}: must be one for all phalanges")


@dataclass(frozen=True)
class Drive:
    """Joint torques and gravity."""

    torques: Annotated[tuple[float, ...], Bound("N m")] = ()
    """t_w, one per phalanx, counter-clockwise positive, acting on the first face of phalanx w.
    Empty: no torque anywhere, or those of `table`."""
    gravity: Annotated[float, Bound("m/s2")] = 9.8
    """g, acting downwards: along -Y on a level surface."""
    reaction: bool = False
    """Whether t_w, w > 1, reacts on the last face of phalanx w - 1, as a motor in the hinge does;
    the paper's eq. 14 has no reaction."""
    incline: Annotated[float, Bound("rad", at_least=-math.pi / 2, at_most=math.pi / 2)] = 0.0
    """Angle by which the surface rises towards +X."""
    table: TorqueTable | None = None
    """Torques over time, instead of `torques`."""

    def __post_init__(self) -> None:
        check_fields(self)
        if self.torques and self.table is not None:
            raise ValueError(f"torques = {self.torques!r}: must be () where a table is given")

    @property
    def gravity_vector(self) -> tuple[float, float]:
        """f, acceleration of gravity in the surface's frame, -g (sin, cos)(incline), m/s²."""
        return -self.gravity * math.sin(self.incline), -self.gravity * math.cos(self.incline)

    def torques_for(self, phalanges: int) -> Torques:
        """Joint torques over time, one per phalanx; raises ValueError if their number differs."""
        steady = TorqueTable((0.0,), (self.torques or (0.0,) * phalanges,))
        table = self.table or steady
        for row in table.values:
            if len(row) != phalanges:
                raise ValueError(
                    f"torques = {list(row)}: {len(row)} values for {phalanges} "
                    f"phalanges; give {phalanges}, or none for a finger without a drive"
                )
        return Torques(np.array(table.time), np.array(table.values, dtype=np.float64))

    def loads_for(self, phalanges: int) -> Torques:
        """The torques that act on each phalanx, reactions included."""
        torques = self.torques_for(phalanges)
        return torques.with_reactions() if self.reaction else torques


@dataclass(frozen=True)
class LumpedContact:
    """The reduced model's contact law, at one point (see `contact.lumped`)."""

    normal_stiffness: Annotated[float, Bound("N/m", above=0)]
    """k."""
    restitution: Annotated[float, Bound(at_least=1e-3, at_most=1)] = 1.0
    """e*, energetic coefficient."""
    tangential_ratio: Annotated[float, Bound(at_least=0)] = 0.75
    """η⁻², tangential over normal stiffness; 0 transmits no tangential force."""
    hertz_force: Annotated[float | None, Bound("N", above=0)] = None
    """None: linear normal elements. A force F*: Hertz's law instead of these,
    F_n = F* (-g/δ*)^1.5 with δ* = 5 F*/(4 k), which stores the same energy F*²/2k at F*."""

    def __post_init__(self) -> None:
        check_fields(self)
        if self.hertz_force is not None and self.restitution != 1.0:
            raise ValueError(
                f"hertz_force = {self.hertz_force}: needs restitution = 1 (it is "
                f"{self.restitution})"
            )

    @property
    def stiffest(self) -> float:
        """Largest slope of the law, N/m: what the explicit step has to resolve.

        Hertz's slope at force F is (6/5) k (F/F*)^(1/3): this covers up to fifteen times F*.
        """
        steep = 3.0 if self.hertz_force is not None else self.restitution**-2
        return self.normal_stiffness * max(steep, self.tangential_ratio)

    @property
    def constants(self) -> tuple[float, float, float, float]:
        """k, e*, η⁻² and F* (0 for the linear law), as the kernel takes them."""
        return (
            self.normal_stiffness,
            self.restitution,
            self.tangential_ratio,
            self.hertz_force or 0.0,
        )


@dataclass(frozen=True)
class Settings:
    """Numerical choices of the explicit run."""

    contact: Contact | LumpedContact = "penalty"
    """Contact law. "penalty": springs at the nodes, as stiff as the elements behind them.
    "surface": a penalty pressure integrated over the surface, of a stiffness that does not depend
    on the mesh. "impulse": no penetration, by forward-increment multipliers. From Python, a
    `LumpedContact`: the reduced model's law, at one point (see `contact.lumped_law`)."""
    penalty_factor: Annotated[
        float, Bound(above=0, at_most=1000, advice="0.1 is LS-DYNA's usual value")
    ] = 0.1
    """f in the nodal stiffness k_i = f K A_i / h_i of "penalty" (see `contact.penalty`)."""
    surface_factor: Annotated[
        float, Bound(above=0, at_most=1e6, advice="1000 adds 0.5 % of Hertz's compliance")
    ] = 1000.0
    """f in the modulus κ = f E*/R of "surface" (see `contact.surface.contact_modulus`)."""
    contact_damping: Annotated[float, Bound(at_least=0, at_most=1, advice="0.2 is usual")] = 0.2
    """Dashpots of "surface" over the body's impedance ρ c; see `contact.surface`."""
    step_factor: Annotated[
        float, Bound(above=0, at_most=2, advice="0.9 is usual, above 1 is unstable")
    ] = 0.9
    """Time step over the stable step 2/ω_max. Above 1 central differences diverge; the run then
    ends with `Status.UNSTABLE`."""
    threads: Annotated[
        int | None,
        Bound(integer=True, at_least=1, at_most=1024, advice="left out, the mesh decides"),
    ] = None
    """Threads of the compiled kernels. None: one below `simulate.THREADED_CELLS` cells, where
    waking a second one costs as much as it saves, else all that numba may use."""
    element: str | None = None
    """Name of the element formulation, one of `model.ELEMENTS` for the mesh's dimension; None takes
    the first of them. In 3D "hex8-sri" and "hex8-one-point", which has no neo-Hookean law."""
    flight: Flight = "rigid"
    """Rigid: the finger's own rigid chain flies up to the contact window. Explicit: all of it, from
    rest, by the explicit loop. Coarse: likewise, but up to the contact window on a coarser mesh of
    the finger (see `coarse_flight`)."""
    lead_steps: Annotated[int, Bound(integer=True, at_least=2)] = 2
    """Explicit steps between the end of the rigid flight and the first touch. Each changes the
    speed of the tip, which falls freely as no hinge pulls at it yet. With one step fewer "impulse"
    would stop nodes before there was a height from which to time the touch."""
    end_time_s: Annotated[float | None, Bound("s", above=0, at_most=LONGEST_S)] = None
    """None ends the run when the first tap is over. A time continues through further taps."""
    tap_until_s: Annotated[float, Bound("s", at_least=0, at_most=LONGEST_S)] = 0.0
    """A tap's touches are those that begin within this time of its first one, so that two models
    can be compared over the same touches; 0: the rule decides (`dynamics.tap`)."""
    max_contact_time_s: Annotated[float, Bound("s", above=0, at_most=LONGEST_S)] = 0.05
    """Longest tap to follow, after `tap_until_s`; beyond it the run ends as STILL_IN_CONTACT."""
    max_flight_time_s: Annotated[float, Bound("s", above=0, at_most=LONGEST_S)] = 2.0
    """Longest fall to wait for; beyond it the run ends as NOT_REACHED."""
    output_interval: Annotated[int | None, Bound(integer=True, at_least=1)] = None
    """Steps between two energy audits, which also sample history and stress; None, and in the first
    tap at most, what aims at about 150 of them in a tap. Forces are recorded at every step
    (`TapResult.forces`)."""
    max_samples: Annotated[int, Bound(integer=True, at_least=16)] = 1000
    """The history keeps between half this number and this number of samples of the first tap, and
    of the contact window beyond it, equally spaced; a longer one is thinned."""
    snapshots: Annotated[int, Bound(integer=True, at_least=2)] = 16
    """Between half this number and this number of fields are kept, equally spaced over the window,
    besides the last one and the one at peak force."""
    max_steps: Annotated[int, Bound(integer=True, at_least=1, at_most=10**15)] = 50_000_000
    """Most explicit steps; a run that is known to need more is refused, any other ends as
    WORK_LIMIT. The default takes some hours for the coarsest finger."""
    estimate: bool = True
    """Whether a completed run states an estimate of its numbers' errors (`TapResult.errors`)."""
    flight_error: bool = True
    """Whether these errors include what a rigid or coarse flight leaves out; false where models
    that fly alike are compared."""
    energy_tolerance: Annotated[float, Bound(above=0, advice="0.1 is usual")] = 0.1
    """The run ends as UNSTABLE where the balance error exceeds this share of the largest kinetic
    energy."""

    def __post_init__(self) -> None:
        check_fields(self)
