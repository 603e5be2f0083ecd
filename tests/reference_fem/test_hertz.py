"""An elastic ball on a rigid plane against Hertz: the test that says the contact is right."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from meshes.ball import half_ball
from reference_fem import Material, Settings, Status, Surface, TapResult
from tests.reference_fem.taps import body, throw

RADIUS = 0.0075
PATCH = 0.07  # edges are even to 1.4 a, over the radius
MATERIAL = Material(1e9, 0.3, 1400.0)
STIFFNESS = 4.0 / 3.0 * MATERIAL.plane_strain_modulus * math.sqrt(RADIUS)


@dataclass(frozen=True)
class Hertz:
    """Impact of a ball of mass m at v on a rigid plane (Johnson, Contact Mechanics, 11.4.1).

    k = 4/3 E* sqrt(R), δ = (5 m v²/4k)^(2/5), F = k δ^(3/2), T = 2.868 (m²/(R E*² v))^(1/5),
    a² = R δ, p_0 = 3F/(2π a²)
    """

    mass: float
    speed: float

    @property
    def approach(self) -> float:
        return (1.25 * self.mass * self.speed**2 / STIFFNESS) ** 0.4

    @property
    def force(self) -> float:
        return STIFFNESS * self.approach**1.5

    @property
    def duration(self) -> float:
        modulus = MATERIAL.plane_strain_modulus
        return 2.868 * (self.mass**2 / (RADIUS * modulus**2 * self.speed)) ** 0.2

    @property
    def patch(self) -> float:
        return math.sqrt(RADIUS * self.approach)

    @property
    def pressure(self) -> float:
        return 1.5 * self.force / (math.pi * self.patch**2)


def impact(tip: float, growth: float, speed: float, friction: float = 0.0, **contact) -> tuple:
    """Result and theory, the theory with the mesh's own mass (facets cut off some of the ball)."""
    mesh = half_ball(RADIUS, tip * RADIUS, growth, patch_size=PATCH * RADIUS)
    settings = Settings(max_contact_time_s=1e-3, output_interval=20, **contact)
    surface = Surface(RADIUS * (1 + 1e-9), friction)
    model = body(mesh, MATERIAL, surface, settings)
    return throw(model, settings, (0.0, -speed)), Hertz(2.0 * model.mass.sum(), speed)


# The law asks for a/R << 1, T >> R/c and small strains. At v/c = 3e-4 the patch is 0.050 R and
# p_0/E* = 2 a/(pi R) = 3.2 %, where St. Venant-Kirchhoff's compression already softens by as much.
SPEED = 3e-4 * MATERIAL.bar_speed


@pytest.fixture(scope="module")
def pressed() -> tuple[TapResult, Hertz]:
    return impact(0.02, 1.5, SPEED, contact="surface")


def check(result: TapResult, hertz: Hertz, tolerance: float) -> None:
    summary = result.summary
    assert result.status is Status.COMPLETED
    assert summary.contact_duration_s == pytest.approx(hertz.duration, rel=tolerance)
    assert summary.peak_normal_force_N == pytest.approx(hertz.force, rel=tolerance)
    # What stays in the ball as vibration is some (v/c)^(6/5) of the energy.
    assert summary.normal_impulse_N_s == pytest.approx(2 * hertz.mass * SPEED, rel=2e-3)
    assert (summary.energy_residual or 1.0) < 1e-3
    half = 0.5 * (summary.contact_duration_s or 0.0)
    assert summary.peak_normal_force_time_s == pytest.approx(half, rel=0.05)


def test_ball_impact_is_hertz(pressed: tuple[TapResult, Hertz]) -> None:
    # Edges of 0.4 a and the penalty's 4 R/(3 pi a f) = 0.8 % of compliance.
    check(*pressed, 0.02)


@pytest.mark.parametrize(
    ("contact", "tolerance"),
    [
        ({"contact": "impulse"}, 0.03),
        # Springs of f K A/h with f = 1 add some 10 % to the ball's own compliance here.
        ({"contact": "penalty", "penalty_factor": 1.0}, 0.06),
    ],
    ids=["impulse", "penalty"],
)
def test_other_laws_are_hertz_too(contact: dict, tolerance: float) -> None:
    check(*impact(0.015, 1.5, SPEED, **contact), tolerance)


def test_pressure_and_patch_are_hertz(pressed: tuple[TapResult, Hertz]) -> None:
    result, hertz = pressed
    top = result.history.peak_pressure_Pa.max()
    # Nodal means over facets of 0.3 a, and the softening above.
    assert top == pytest.approx(hertz.pressure, rel=0.1)
    # The area is counted in ninths of a facet, the rim is one facet wide.
    patch = math.sqrt(result.history.contact_area_m2.max() / math.pi)
    assert patch == pytest.approx(hertz.patch, rel=0.15)
    field = next(s for s in result.snapshots if s.at_peak).contact_pressure_Pa
    assert field.max() == pytest.approx(top, rel=2e-3)  # peak force and peak pressure differ
    assert np.count_nonzero(field) < 0.05 * field.size


def peaks(result: TapResult, hertz: Hertz) -> tuple[float, float]:
    summary = result.summary
    return (
        (summary.peak_normal_force_N or math.nan) / hertz.force,
        (summary.contact_duration_s or math.nan) / hertz.duration,
    )


def extrapolated(ratio: float, values: tuple[float, ...]) -> float:
    """Richardson's limit of sizes that fall by `ratio`, of order 2 at most.

    The finest value where the last three do not go one way, or hardly slow down.
    """
    coarse, middle, fine = values[-3:]
    if (middle - coarse) * (fine - middle) <= 0.0:
        return fine
    order = math.log((middle - coarse) / (fine - middle)) / math.log(ratio)
    return fine + (fine - middle) / (ratio ** min(order, 2.0) - 1.0) if order >= 0.5 else fine


@pytest.mark.slow
def test_ball_converges_to_hertz() -> None:
    # Four meshes, each edge split by sqrt 2. What Hertz leaves out is of order a/R = 5 % of his
    # approach, each with its share of it: the free ball is stiffer than a half-space (-2.2 %, by
    # Lur'e's harmonics of the sphere), pressure is vertical (-0.6 %), St. Venant-Kirchhoff softens
    # (some +1.7 %), the penalty adds 4 R/(3 pi a f) = 0.8 %. The peak goes with three quarters of
    # their sum, whose parts are known to half a percent.
    root = math.sqrt(2.0)
    ratios = (2 * root, 2.0, root, 1.0)
    found = [peaks(*impact(0.01 * r, 1.25**r, SPEED, contact="surface", threads=2)) for r in ratios]
    for values in zip(*found, strict=True):
        errors = [abs(value - 1.0) for value in values]
        assert errors[-1] < 0.01
        assert errors[-1] < errors[0]
        assert extrapolated(root, values) == pytest.approx(1.0, abs=0.02)


@pytest.mark.slow
def test_half_ball_rubs_as_hertz_presses() -> None:
    # With friction and no sliding speed the ball sticks: no tangential resultant, and the normal
    # force rises by what shear under the patch adds (Spence: at most 5 % at nu = 0.3).
    smooth, _ = impact(0.02, 1.4, SPEED, contact="surface")
    rough, _ = impact(0.02, 1.4, SPEED, friction=0.5, contact="surface")
    ratio = (rough.summary.peak_normal_force_N or 0) / (smooth.summary.peak_normal_force_N or 1)
    assert 1.0 < ratio < 1.05
    normal = rough.history.normal_force_N.max()
    assert np.abs(rough.history.tangential_force_N).max() < 1e-6 * normal
