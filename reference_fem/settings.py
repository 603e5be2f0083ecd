"""What a run is given: materials, surface, drive and numerical settings (SI units)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from reference_fem.contact.lumped import LumpedContact

Flight = Literal["rigid", "explicit"]
FLIGHTS: tuple[str, ...] = ("rigid", "explicit")
Contact = Literal["penalty", "surface", "impulse"]
CONTACTS: tuple[str, ...] = ("penalty", "surface", "impulse")


def _finite(key: str, value: float, remedy: str) -> None:
    if not math.isfinite(value):
        raise ValueError(f"{key} = {value}: must be a finite number; {remedy}")


def _positive(key: str, value: float, remedy: str) -> None:
    _finite(key, value, remedy)
    if value <= 0.0:
        raise ValueError(f"{key} = {value}: must be greater than 0; {remedy}")


@dataclass(frozen=True)
class Material:
    """An isotropic elastic material; one per phalanx.

    Parameters
    ----------
    youngs_modulus
        E, Pa, greater than 0.
    poisson_ratio
        ν, between -1 and 0.5, both excluded.
    density
        ρ of the undeformed body, kg/m³, greater than 0.

    Raises
    ------
    ValueError
        Naming the key, its value and what is allowed.
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        _positive("youngs_modulus", self.youngs_modulus, "give it in Pa")
        _positive("density", self.density, "give it in kg/m3")
        if not -1.0 < self.poisson_ratio < 0.5:
            raise ValueError(
                f"poisson_ratio = {self.poisson_ratio}: must lie between -1 and 0.5, both "
                "excluded; an incompressible body needs a value such as 0.49"
            )

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
    """The rigid plane Y = -height.

    Parameters
    ----------
    height
        H, m, greater than 0.
    friction
        Coulomb's μ, at least 0.

    Raises
    ------
    ValueError
        Naming the key, its value and what is allowed.
    """

    height: float
    friction: float

    def __post_init__(self) -> None:
        _positive("height", self.height, "the surface lies at Y = -height, in m")
        _finite("friction", self.friction, "give a Coulomb coefficient such as 0.5")
        if self.friction < 0.0:
            raise ValueError(
                f"friction = {self.friction}: must not be negative; 0 means a smooth surface"
            )


@dataclass(frozen=True)
class Drive:
    """Joint torques and gravity.

    Parameters
    ----------
    torques
        t_w, N·m, one per phalanx, counter-clockwise positive, acting on phalanx w at its first
        hinge without a reaction on its neighbour (paper eq. 14). Empty: no torque anywhere.
    gravity
        g, m/s², acting along -Y.

    Raises
    ------
    ValueError
        For values that are not finite.
    """

    torques: tuple[float, ...] = ()
    gravity: float = 9.8

    def __post_init__(self) -> None:
        for number, torque in enumerate(self.torques, start=1):
            _finite(f"torques[{number}]", torque, "give N m")
        _finite("gravity", self.gravity, "give m/s2")

    def torques_for(self, phalanges: int) -> tuple[float, ...]:
        """One torque per phalanx; raises ValueError if their number differs."""
        if not self.torques:
            return (0.0,) * phalanges
        if len(self.torques) != phalanges:
            raise ValueError(
                f"torques = {list(self.torques)}: {len(self.torques)} values for {phalanges} "
                f"phalanges; give {phalanges}, or none for a finger without a drive"
            )
        return tuple(self.torques)


@dataclass(frozen=True)
class Settings:
    """Numerical choices of the explicit run.

    Parameters
    ----------
    contact
        Contact law. "penalty": springs at the nodes, as stiff as the elements behind them.
        "surface": a penalty pressure integrated over the surface, of a stiffness that does not
        depend on the mesh. "impulse": no penetration, by forward-increment multipliers. A
        `LumpedContact`: the reduced model's law, at one point (see `contact.lumped_point`).
    penalty_factor
        f in the nodal stiffness k_i = f K A_i / h_i of "penalty" (see `contact_stiffness`).
    surface_factor
        f in the modulus κ = f E*/R of "surface" (see `surface_contact.contact_modulus`).
    contact_damping
        Dashpots of "surface" over the body's impedance ρ c, from 0 to 1; see `surface_contact`.
    step_factor
        Time step over the stable step 2/ω_max. Above 1 central differences diverge; the run
        then ends with `Status.UNSTABLE`.
    threads
        Threads of the compiled kernels. None: one below `simulate.THREADED_CELLS` cells, where
        waking a second one costs as much as it saves, else all that numba may use.
    element
        Name of the element formulation, one of `model.ELEMENTS` for the mesh's dimension; None
        takes the first of them.
    flight
        "rigid": the finger's own rigid chain flies up to the contact window. "explicit": all of
        it, from rest, by the explicit loop.
    lead_steps
        Explicit steps between the end of the rigid flight and the first touch.
    end_time_s
        None ends the run when the first tap is over. A time continues through further taps.
    max_contact_time_s
        Longest contact to follow; beyond it the run ends as STILL_IN_CONTACT.
    max_flight_time_s
        Longest fall to wait for; beyond it the run ends as NOT_REACHED.
    output_interval
        Steps between two energy audits, which also sample history and stress; None aims at some
        150 of them in a tap. Forces are recorded at every step (`TapResult.forces`).
    max_samples
        The history keeps between half this number and this number of samples of the contact
        window, equally spaced; a longer window is thinned.
    snapshots
        Between half this number and this number of fields are kept, equally spaced over the
        window, besides the last one and the one at peak force.
    max_steps
        Most explicit steps; a run that needs more is refused where that is known, else it ends as
        WORK_LIMIT. The default is some hours of the coarsest finger.
    energy_tolerance
        The run ends as UNSTABLE where the balance error exceeds this share of the largest
        kinetic energy.

    Raises
    ------
    ValueError
        Naming the key, its value and what is allowed.
    """

    contact: Contact | LumpedContact = "penalty"
    penalty_factor: float = 0.1
    surface_factor: float = 1000.0
    contact_damping: float = 0.2
    step_factor: float = 0.9
    threads: int | None = None
    element: str | None = None
    flight: Flight = "rigid"
    lead_steps: int = 20
    end_time_s: float | None = None
    max_contact_time_s: float = 5e-3
    max_flight_time_s: float = 2.0
    output_interval: int | None = None
    max_samples: int = 1000
    snapshots: int = 16
    max_steps: int = 50_000_000
    energy_tolerance: float = 0.1

    def __post_init__(self) -> None:
        _positive("penalty_factor", self.penalty_factor, "0.1 is LS-DYNA's usual value")
        _positive("surface_factor", self.surface_factor, "1000 adds 1 % of Hertz's compliance")
        if not 0.0 <= self.contact_damping <= 1.0:
            raise ValueError(
                f"contact_damping = {self.contact_damping}: must lie between 0 and 1; 0.2 is usual"
            )
        _positive("step_factor", self.step_factor, "0.9 is usual, above 1 is unstable")
        _positive("max_contact_time_s", self.max_contact_time_s, "give seconds")
        _positive("max_flight_time_s", self.max_flight_time_s, "give seconds")
        _positive("energy_tolerance", self.energy_tolerance, "0.1 is usual")
        if self.end_time_s is not None:
            _positive("end_time_s", self.end_time_s, "give seconds, or leave it out")
        for key, least in (
            ("output_interval", 1),
            ("max_samples", 16),
            ("snapshots", 2),
            ("lead_steps", 1),
            ("max_steps", 1),
        ):
            value = getattr(self, key)
            if value is None and key == "output_interval":
                continue
            if not isinstance(value, int) or value < least:
                raise ValueError(f"{key} = {value}: must be a whole number, at least {least}")
        if self.threads is not None and (not isinstance(self.threads, int) or self.threads < 1):
            raise ValueError(
                f"threads = {self.threads}: must be a whole number, at least 1, or left out"
            )
        if not isinstance(self.contact, LumpedContact) and self.contact not in CONTACTS:
            raise ValueError(
                f"contact = {self.contact!r}: must be one of {', '.join(map(repr, CONTACTS))}"
            )
        if self.flight not in FLIGHTS:
            raise ValueError(
                f"flight = {self.flight!r}: must be one of {', '.join(map(repr, FLIGHTS))}"
            )
