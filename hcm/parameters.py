"""Parameters of the reduced model: finger, surface, tip, drive and solver settings (SI units).

Every class is frozen and checks itself when it is made; `dataclasses.replace` gives a changed copy.
A refusal is a `ParameterError` that names the field, the value and what is allowed.
"""

import math
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import Annotated, Final, Literal

from hcm.bounds import Bound, ParameterError, check_fields, check_kind

Flight = Literal["elastic", "modal", "rigid"]
FlightIntegrator = Literal["generalized-alpha", "gauss"]
MaterialLaw = Literal["saint-venant-kirchhoff", "neo-hooke"]

GENERALIZED_ALPHA: Final = "generalized-alpha"
GAUSS: Final = "gauss"
SAINT_VENANT: Final = "saint-venant-kirchhoff"
NEO_HOOKE: Final = "neo-hooke"
STAGES = 5

SIZE = Bound("m", at_least=1e-20, at_most=1e20)
"""Bound on lengths: with `PER_SIZE`, their products and quotients neither over- nor underflow."""
PER_SIZE = {"at_least": 1e-40, "at_most": 1e40}

LONGEST_S = 1e12
"""Bound on times: beyond it sums of steps lose their digits."""


@dataclass(frozen=True)
class Phalanx:
    """One link: a round bar meshed with equal ANCF beam elements."""

    length: Annotated[float, SIZE]
    """L_w."""
    diameter: Annotated[float, SIZE]
    """d_w."""
    youngs_modulus: Annotated[float, Bound("Pa", **PER_SIZE)]
    """E_w."""
    density: Annotated[float, Bound("kg/m3", **PER_SIZE)]
    """rho_w."""
    elements: Annotated[int, Bound(integer=True, at_least=1)] = 20
    """n_w, number of beam elements along the phalanx."""
    relaxation_time: Annotated[float, Bound("s", at_least=0, at_most=LONGEST_S)] = 0.0
    """tau_w of Kelvin-Voigt damping, stress E (strain + tau strain rate); 0: none."""
    poisson_ratio: Annotated[float | None, Bound(at_least=0, below=0.5)] = None
    """nu_w; the paper's model does not use it, the refined one needs it."""
    material_law: MaterialLaw = SAINT_VENANT
    """Stress at finite strain of the last phalanx's round end (`deforming_tip`, `growing_patch`);
    beams strain little."""

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def area(self) -> float:
        """A_w = pi d^2/4, m^2."""
        return math.pi * self.diameter**2 / 4

    @property
    def second_moment(self) -> float:
        """I_w = pi d^4/64, m^4."""
        return math.pi * self.diameter**4 / 64

    @property
    def bending_stiffness(self) -> float:
        """E_w I_w, N m^2."""
        return self.youngs_modulus * self.second_moment

    @property
    def line_density(self) -> float:
        """rho_w A_w, kg/m."""
        return self.density * self.area


@dataclass(frozen=True)
class Finger:
    """Phalanges in order from the fixed hinge (the origin) to the tip."""

    phalanges: tuple[Phalanx, ...]

    def __post_init__(self) -> None:
        check_fields(self)
        if not self.phalanges:
            raise ParameterError("phalanges = (): a finger needs at least one phalanx")

    @property
    def length(self) -> float:
        """Total length, m."""
        return sum(p.length for p in self.phalanges)


@dataclass(frozen=True)
class Surface:
    """The rigid rough line Y = -height."""

    height: Annotated[float, SIZE]
    """H, depth of the surface below the fixed hinge."""
    friction: Annotated[float, Bound(at_least=0)]
    """mu, coefficient of Coulomb friction; 0: no tangential force."""

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Tip:
    """Lumped-parameter contact of the fingertip (paper, section 2.2.2)."""

    normal_stiffness: Annotated[float | None, Bound("N/m", above=0)] = None
    """k, slope of the normal element while it is compressed; needed by these
    assumptions alone: `Assumptions.needs_stiffness`."""
    restitution: Annotated[float, Bound(at_least=1e-3, at_most=1)] = 1.0
    """e*, energetic coefficient; the slope of restitution is k/e*^2."""
    tangential_ratio: Annotated[float, Bound(at_least=0)] = 0.75
    """eta^-2, tangential over normal stiffness; 0 transmits no tangential force."""
    compliance_nn: Annotated[float | None, Bound(at_least=-10, at_most=10)] = None
    """E R c_nn of the tip's own compliance (`hcm.contact.tip_compliance`); None: the closed
    form."""
    compliance_nt: Annotated[float | None, Bound(at_least=-10, at_most=10)] = None
    """E R c_nt at rest; None: the closed form."""
    compliance_tt: Annotated[float | None, Bound(at_least=-10, at_most=10)] = None
    """E R c_tt/cos(alpha); None: the closed form."""

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def k(self) -> float:
        """Its normal stiffness, N/m. Raises ParameterError: there is none."""
        if self.normal_stiffness is None:
            raise ParameterError("tip.normal_stiffness is missing: a spring needs it")
        return self.normal_stiffness


@dataclass(frozen=True)
class TorqueTable:
    """Joint torques over time: linear between its times, held before the first and after the last.

    Two equal times are a jump.
    """

    time: Annotated[tuple[float, ...], Bound("s", at_least=0, at_most=LONGEST_S)]
    """(n,), s, in rising order; at most two in a row may be equal."""
    values: tuple[tuple[float, ...], ...]
    """(n, P), tau_w in N m."""

    def __post_init__(self) -> None:
        check_fields(self)
        check_kind("torques.values", self.values, tuple)
        for row in self.values:
            check_kind("torques.values", row, tuple)
        if not self.time or len(self.time) != len(self.values):
            raise ParameterError(
                f"torques: {len(self.time)} times and {len(self.values)} rows of values: must be"
                " equal, and at least one"
            )
        if len(lengths := {len(row) for row in self.values}) > 1:
            words = " and ".join(map(str, sorted(lengths)))
            raise ParameterError(
                f"torques.values: has rows of {words} values: each must have one per phalanx"
            )
        for torque in chain.from_iterable(self.values):
            if not (known := Bound("N m")).holds(torque):
                raise ParameterError(f"torques.values = {torque!r}: must be {known.allowed()}")
        for n, (before, after) in enumerate(pairwise(self.time)):
            if after < before or after == (self.time[n - 1] if n else None):
                raise ParameterError(
                    f"torques.time = {after!r}: must not be before {before!r}, nor a third equal"
                    " time"
                )


@dataclass(frozen=True)
class Drive:
    """Joint torques and gravity."""

    torques: Annotated[tuple[float, ...], Bound("N m")] = ()
    """tau_w, counter-clockwise, one per phalanx, on the phalanx's first node; empty: none, or those
    of `table`."""
    gravity: Annotated[float, Bound("m/s2")] = 9.8
    """g, downwards: along -Y on a level surface."""
    reaction: bool = False
    """Whether each torque w > 1 reacts on the previous phalanx's last node (a motor in the hinge).
    The paper's eq. 14 has no reaction."""
    incline: Annotated[float, Bound("rad", at_least=-math.pi / 2, at_most=math.pi / 2)] = 0.0
    """Angle by which the surface rises towards +X."""
    table: TorqueTable | None = None
    """Torques over time, instead of `torques`."""

    def __post_init__(self) -> None:
        check_fields(self)
        if self.torques and self.table is not None:
            raise ParameterError(f"torques = {self.torques!r}: must be () where a table is given")

    @property
    def has_torques(self) -> bool:
        """Whether it has a table, or any torque but zero."""
        return self.table is not None or any(self.torques)

    @property
    def gravity_vector(self) -> tuple[float, float]:
        """f, acceleration by gravity in the surface's frame, -g (sin, cos)(incline), m/s^2."""
        return -self.gravity * math.sin(self.incline), -self.gravity * math.cos(self.incline)


@dataclass(frozen=True)
class Settings:
    """Numerical settings; the defaults are the paper's, with a finer flight."""

    flight: Flight = "elastic"
    """Elastic throughout; modal until the first touch (`hcm.modal_flight`), in long steps to whose
    end the vibration of a start at rest is added (rows before it are without); or rigid until then
    (`hcm.flight.rigid_flight`), which leaves out the finger's bending and vibration on the way
    down."""
    flight_step: Annotated[float, Bound("s", above=0, at_most=1)] = 1e-4
    """Longest step out of contact."""
    flight_elements: Annotated[int, Bound(integer=True, at_least=0, at_most=10_000)] = 0
    """Elements of each phalanx, at most the finger's own, in an elastic flight up to the first
    touch, where they are divided into the finger's own (`hcm.beam.division`). Whatever their
    number, their masses keep a vibration in phase (`hcm.beam.customized_mass`); 0: the finger's own
    elements and masses throughout."""
    flight_tolerance: Annotated[float, Bound(at_least=0, at_most=1)] = 1e-6
    """Bound on a flight step's local error over the surface's depth (surface.height), which
    shortens the steps where vibrations matter; 0 keeps all flight steps at `flight_step`. The depth
    is the height of the fall: an error that is small for a finger is large for a fall of 1 um."""
    contact_step: Annotated[float, Bound("s", above=0, at_most=1)] = 1e-6
    """Longest step in contact. Any step is shortened to end on an event, and when Newton's method
    fails."""
    contact_tolerance: Annotated[float, Bound("m", at_least=0, at_most=1)] = 1e-11
    """Bound on a contact step's local error; 0 keeps the steps at `contact_step`."""
    spectral_radius: Annotated[float, Bound(at_least=0, at_most=1)] = 0.8
    """xi, generalized-alpha's spectral radius at infinite frequency. Flights after a tap whose
    steps `flight_tolerance` controls take xi = 1, the trapezoidal rule: the vibration that a tap
    leaves lasts, and damping it would cost 1e-2 of the energy."""
    newton_tolerance: Annotated[float, Bound(at_least=1e-13, at_most=1e-3)] = 1e-9
    """Largest change of an acceleration, relative to the largest acceleration, at which Newton's
    iteration stops."""
    taps: Annotated[int, Bound(integer=True, at_least=1, at_most=10_000)] = 1
    """The run ends at the separation that ends this many taps, unless `end_time` is given."""
    tap_until: Annotated[float, Bound("s", at_least=0, at_most=LONGEST_S)] = 0.0
    """With `whole_tap`, a tap's touches are those that begin within this time of its first one, to
    compare another model's tap over the same touches; 0: the rule decides (`hcm.taps.tap`)."""
    end_time: Annotated[float | None, Bound("s", above=0, at_most=LONGEST_S)] = None
    """If given, the run goes on through further taps until then."""
    max_flight_time: Annotated[float, Bound("s", above=0, at_most=LONGEST_S)] = 2.0
    """A flight that lasts longer ends the run as `NOT_REACHED`."""
    max_contact_time: Annotated[float, Bound("s", above=0, at_most=LONGEST_S)] = 0.05
    """A contact that lasts longer ends the run as `STILL_IN_CONTACT`."""
    max_steps: Annotated[int, Bound(integer=True, at_least=1, at_most=10**15)] = 500_000
    """Bound on the accepted steps of one run, each a row of the history, and on its work: 20 Newton
    iterations a step."""
    consistent_start: bool = True
    """Whether the motion starts with the acceleration that solves the equations. False starts it
    from zero, as the paper's fig. 6 does: the first step then applies torques gradually, and
    vibrations faster than the step are never excited. Where `flight_tolerance` controls the steps
    the first one is at most `contact_step`: half its loads are left out."""
    reuse_factors: bool = True
    """Whether a factorization serves as long as Newton's iteration shrinks the change tenfold with
    it; False makes a new one in every iteration, which changes no result beyond
    `newton_tolerance`."""
    flight_integrator: FlightIntegrator = GENERALIZED_ALPHA
    """Generalized-alpha, or Gauss: collocation out of contact, which keeps vibrations
    in phase over long flights at much longer steps (`hcm.integrators.gauss`); its
    `flight_tolerance` bounds what the last term of a step's polynomial adds to it."""
    contact_integrator: FlightIntegrator = GENERALIZED_ALPHA
    """Generalized-alpha, or Gauss: collocation in contact too, in far longer steps, each of which
    has a row of the history at each stage (`hcm.results.stage_rows`)."""
    stages: Annotated[int, Bound(integer=True, at_least=2, at_most=12)] = STAGES
    """Stages of a step of collocation; its order is twice their number. With more stages the length
    of a step that keeps a vibration in phase grows faster than its cost."""
    frame_times: Annotated[tuple[float, ...], Bound("s", at_least=0)] = ()
    """Times, in rising order, at which the posture is kept (interpolated, steps unchanged)."""
    estimate: bool = True
    """Whether the errors of the first tap's numbers are estimated, which takes a second, cheaper
    solve, and a third one for folded fingers and taps that barely end (`hcm.estimates`)."""

    def __post_init__(self) -> None:
        check_fields(self)
        for earlier, time in pairwise(self.frame_times):
            if time < earlier:
                raise ParameterError(f"frame_times = {time!r}: must be in rising order")
