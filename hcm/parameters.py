"""What is given: finger, surface, tip, drive and solver settings of the reduced model (SI units).

Every class is frozen and checks itself when it is made; `dataclasses.replace` gives a changed copy.
A refusal is a `ParameterError` that names the field, the value, what is allowed and what to do.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from typing import Literal, get_args

Flight = Literal["elastic", "rigid"]

GENERALIZED_ALPHA, GAUSS = "generalized-alpha", "gauss"
FLIGHT_INTEGRATORS = (GENERALIZED_ALPHA, GAUSS)


class ParameterError(ValueError):
    """A parameter lies outside what the model can compute with."""


def _require(field: str, value: float, allowed: str, holds: bool) -> None:
    if not (isinstance(value, (int, float)) and math.isfinite(value) and holds):
        raise ParameterError(f"{field} = {value!r}: must be {allowed}")


def _whole(owner: object, field: str) -> None:
    """Keep a count as a plain int: numpy's integers count too, truth values and floats do not."""
    value = getattr(owner, field)
    try:
        count = 0 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        count = 0
    if count < 1:
        raise ParameterError(f"{field} = {value!r}: must be a whole number above 0")
    object.__setattr__(owner, field, count)


def _require_positive(field: str, value: float) -> None:
    _require(field, value, "a finite number above 0", value > 0)


@dataclass(frozen=True)
class Phalanx:
    """One link: a round bar meshed with equal ANCF beam elements.

    Parameters
    ----------
    length : L_w, m.
    diameter : d_w, m.
    youngs_modulus : E_w, Pa.
    density : rho_w, kg/m^3.
    elements : n_w, number of beam elements along the phalanx.
    """

    length: float
    diameter: float
    youngs_modulus: float
    density: float
    elements: int = 20

    def __post_init__(self) -> None:
        for field in ("length", "diameter", "youngs_modulus", "density"):
            _require_positive(field, getattr(self, field))
        _whole(self, "elements")

    @property
    def area(self) -> float:
        """A_w = pi d^2/4, m^2."""
        return math.pi * self.diameter**2 / 4

    @property
    def second_moment(self) -> float:
        """I_w = pi d^4/64, m^4."""
        return math.pi * self.diameter**4 / 64


@dataclass(frozen=True)
class Finger:
    """Phalanges in order from the fixed hinge (the origin) to the tip."""

    phalanges: tuple[Phalanx, ...]

    def __post_init__(self) -> None:
        if not self.phalanges:
            raise ParameterError("phalanges = (): a finger needs at least one phalanx")

    @property
    def length(self) -> float:
        """Total length, m."""
        return sum(p.length for p in self.phalanges)


@dataclass(frozen=True)
class Surface:
    """The rigid rough line Y = -height.

    Parameters
    ----------
    height : H, m, depth of the surface below the fixed hinge.
    friction : mu, coefficient of Coulomb friction; 0 leaves out the tangential state.
    """

    height: float
    friction: float

    def __post_init__(self) -> None:
        _require_positive("height", self.height)
        _require("friction", self.friction, "a finite number, 0 or above", self.friction >= 0)


@dataclass(frozen=True)
class Tip:
    """Lumped-parameter contact of the fingertip (paper, section 2.2.2).

    Parameters
    ----------
    normal_stiffness : k, N/m, slope of the normal element while it is compressed.
    restitution : e*, energetic coefficient in (0, 1]; the slope of restitution is k/e*^2.
    tangential_ratio : eta^-2, tangential over normal stiffness; 0 transmits no tangential force.
    """

    normal_stiffness: float
    restitution: float = 1.0
    tangential_ratio: float = 0.75

    def __post_init__(self) -> None:
        _require_positive("normal_stiffness", self.normal_stiffness)
        _require("restitution", self.restitution, "in (0, 1]", 0 < self.restitution <= 1)
        _require(
            "tangential_ratio",
            self.tangential_ratio,
            "a finite number, 0 or above",
            self.tangential_ratio >= 0,
        )


@dataclass(frozen=True)
class Drive:
    """Joint torques and gravity.

    Parameters
    ----------
    torques : tau_w, N m, counter-clockwise, one per phalanx, on the phalanx's first node; an empty
        tuple means none.
    gravity : g, m/s^2, along -Y.
    reaction : whether each torque w > 1 reacts on the previous phalanx's last node (a motor in the
        hinge). The paper's eq. 14 has no reaction.
    """

    torques: tuple[float, ...] = ()
    gravity: float = 9.8
    reaction: bool = False

    def __post_init__(self) -> None:
        for torque in self.torques:
            _require("torques", torque, "finite numbers", True)
        _require("gravity", self.gravity, "a finite number", True)


@dataclass(frozen=True)
class Settings:
    """Numerical choices; the paper's, with a finer flight.

    Parameters
    ----------
    flight : "elastic" throughout, or "rigid" until the first touch (`hcm.flight.rigid_flight`): the
        finger's bending and vibration on the way down are left out.
    flight_step : s, longest step out of contact.
    flight_tolerance : m, bound on a flight step's local error, which shortens the steps where
        vibrations matter; 0 keeps all flight steps at `flight_step`.
    contact_step : s, longest step in contact. Any step is shortened to end on an event, and when
        Newton's method fails.
    contact_tolerance : m, bound on a contact step's local error; 0 keeps them at `contact_step`.
    spectral_radius : xi in [0, 1], generalized-alpha's spectral radius at infinite frequency.
        Flights after a tap whose steps `flight_tolerance` controls take xi = 1, the trapezoidal
        rule: the vibration that a tap leaves lasts, and damping it would cost 1e-2 of the energy.
    newton_tolerance : largest change of an acceleration, relative to the largest acceleration, at
        which Newton's iteration stops.
    taps : the run ends at the separation that ends this many taps, unless `end_time` is given.
    end_time : s, or None; when given the run goes on through further taps until then.
    max_flight_time : s, a flight that lasts longer ends the run as `NOT_REACHED`.
    max_contact_time : s, a contact that lasts longer ends the run as `STILL_IN_CONTACT`.
    max_steps : bound on the accepted steps of one run, each a row of the history, and on its work:
        20 Newton iterations a step.
    consistent_start : whether the motion starts with the acceleration that the equations ask for.
        False starts it from zero, as the paper's fig. 6 does: the first step then applies torques
        gradually, and vibrations faster than the step are never excited. Where `flight_tolerance`
        controls the steps the first one is at most `contact_step`: half its loads are left out.
    reuse_factors : whether a factorization serves as long as Newton's iteration shrinks the change
        tenfold with it; False makes a new one in every iteration, which changes no result beyond
        `newton_tolerance`.
    flight_integrator : "generalized-alpha", or "gauss": collocation of order 10 out of contact,
        which keeps vibrations in phase over long flights at much longer steps
        (`hcm.integrators.gauss`); its `flight_tolerance` bounds what the last
        term of a step's polynomial adds to it.
    frame_times : s, rising; the posture is kept at these times (interpolated, steps unchanged).
    repeat : whether a run whose finger folded up, or whose tap barely ended, is solved again with
        other tolerances to see whether it can be relied on (`hcm.sensitivity`); others never are.
    """

    flight: Flight = "elastic"
    flight_step: float = 1e-4
    flight_tolerance: float = 1e-7
    contact_step: float = 1e-6
    contact_tolerance: float = 1e-11
    spectral_radius: float = 0.8
    newton_tolerance: float = 1e-9
    taps: int = 1
    end_time: float | None = None
    max_flight_time: float = 2.0
    max_contact_time: float = 0.05
    max_steps: int = 500_000
    consistent_start: bool = True
    reuse_factors: bool = True
    flight_integrator: str = GENERALIZED_ALPHA
    frame_times: tuple[float, ...] = ()
    repeat: bool = True

    def __post_init__(self) -> None:
        if self.flight not in get_args(Flight):
            allowed = " or ".join(map(repr, get_args(Flight)))
            raise ParameterError(f"flight = {self.flight!r}: must be {allowed}")
        for field in (
            "flight_step",
            "contact_step",
            "max_flight_time",
            "max_contact_time",
        ):
            _require_positive(field, getattr(self, field))
        for field in ("flight_tolerance", "contact_tolerance"):
            value = getattr(self, field)
            _require(field, value, "a finite number, 0 or above", value >= 0)
        _require(
            "spectral_radius",
            self.spectral_radius,
            "in [0, 1]",
            0 <= self.spectral_radius <= 1,
        )
        _require(
            "newton_tolerance",
            self.newton_tolerance,
            "in [1e-13, 1e-3]",
            1e-13 <= self.newton_tolerance <= 1e-3,
        )
        if self.flight_integrator not in FLIGHT_INTEGRATORS:
            names = " or ".join(repr(name) for name in FLIGHT_INTEGRATORS)
            raise ParameterError(f"flight_integrator = {self.flight_integrator!r}: must be {names}")
        for field in ("taps", "max_steps"):
            _whole(self, field)
        if self.end_time is not None:
            _require_positive("end_time", self.end_time)
        for i, time in enumerate(self.frame_times):
            earlier = self.frame_times[i - 1] if i else 0.0
            _require("frame_times", time, "0 or above and in rising order", time >= earlier)


def check_scene(finger: Finger, surface: Surface, drive: Drive) -> None:
    """Check what no single object can: parts that must fit each other.

    Raises
    ------
    ParameterError
        The number of torques is not the number of phalanges, or the surface is out of reach.
    """
    if drive.torques and len(drive.torques) != len(finger.phalanges):
        raise ParameterError(
            f"torques has {len(drive.torques)} values: must be one per phalanx"
            f" ({len(finger.phalanges)}), or none"
        )
    if surface.height >= finger.length:
        raise ParameterError(
            f"height = {surface.height!r}: must be below the finger's length {finger.length:g} m,"
            " or the tip never reaches the surface"
        )
