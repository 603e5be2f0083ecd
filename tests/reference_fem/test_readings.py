"""What is read off the run: transitions, stress at R, thickness, thinned records."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import meshes
from reference_fem import Drive, Material, Settings, Surface
from reference_fem.dynamics.recorder import Thinned
from reference_fem.elements.kinds import chord_thickness
from reference_fem.model import build_model
from reference_fem.results.result import ForceRecord, Summary
from reference_fem.results.summary import confirmed_maxima, slip_states, summarize
from tests.reference_fem.boxes import boxes
from tests.reference_fem.taps import GEOMETRY, body


def test_maxima_of_three_humps() -> None:
    t = np.linspace(0, 1, 1001)
    force = np.sin(np.pi * t) * (1.2 + np.cos(4 * np.pi * t)) + 0.01 * np.sin(400 * t)
    found = confirmed_maxima(force, 0.1)
    assert len(found) == 3
    assert t[found[1]] == pytest.approx(0.5, abs=0.01)
    assert len(confirmed_maxima(force, 1e-4)) > 10  # the ringing that prominence leaves out
    assert confirmed_maxima(np.zeros(5), 0.1) == []


def test_slip_states_of_a_reversal() -> None:
    normal = np.full(600, 2.0)
    tangential = np.concatenate(
        [
            np.full(100, -1.0),
            np.linspace(-1.0, 1.0, 200),
            np.full(100, 1.0),
            np.linspace(1.0, 0.0, 200),
        ]
    )
    states = slip_states(normal, tangential, 0.5, 0.1)
    assert states == {"stick_to_slip": 1, "slip_to_stick": 2, "reverse_slip": True}
    still = slip_states(normal, 0.1 * tangential, 0.5, 0.1)
    assert still == {"stick_to_slip": 0, "slip_to_stick": 0, "reverse_slip": False}
    # Forces too small to judge are left out.
    assert slip_states(0.01 * normal, tangential, 0.5, 0.1)["stick_to_slip"] == 0


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    ("axial", "moved"), [(1, 0.0), (3, 0.0), (4, 0.0), (3, 0.3), (4, 0.3), (4, -0.49), (5, 1e-9)]
)
@pytest.mark.parametrize("force", [0.0, 0.5])
def test_stress_probe_reads_a_beam_in_any_direction(
    dim: int, axial: int, moved: float, force: float
) -> None:
    # nu = 0, curvature q = b + f x about mid-length, u_x = e x - (b x + f x²/2) y,
    # u_y = b x²/2 + f x³/6: axial strain e - q y, no shear; then turned by 50 degrees. Layers of
    # cells are moved along the axis by a share of their length. The exact reading at mid-length,
    # y = -h/2, is E (e + b h/2), up to O(strain) and cells' length squared over the beam's.
    mesh = boxes((0.04,), (0.01, 0.01)[: dim - 1], (axial, 4, 2)[:dim])
    young, stretch, curvature, slope = 1e9, 2e-6, 1e-3, force
    points = mesh.points.copy()
    inside = np.abs(points[:, 0] + 0.02) < 0.0199
    points[inside, 0] += moved * 0.04 / axial
    mesh = replace(mesh, points=points)
    model = build_model(
        mesh, (Material(young, 0.0, 1000.0),), Surface(1.0, 0.0), Drive(), Settings()
    )
    x, y = points[:, 0] + 0.02, points[:, 1]
    now = points.copy()
    now[:, 0] += stretch * x - (curvature * x + slope * x**2 / 2) * y
    now[:, 1] += 0.5 * curvature * x**2 + slope * x**3 / 6
    c, s = np.cos(0.87), np.sin(0.87)
    turned = now.copy()
    turned[:, 0], turned[:, 1] = c * now[:, 0] - s * now[:, 1], s * now[:, 0] + c * now[:, 1]
    reading = model.probe.read(model.kernel, turned - points, np.zeros_like(now))
    assert reading == pytest.approx(young * (stretch + curvature * 0.005), rel=1e-3)


def test_stress_probe_reads_at_the_round_surface() -> None:
    """Not where the vertices of a mesh of the whole volume are: 0.4 % further out."""
    sizing = meshes.Sizing(2e-3, 3e-3, 1e-3, growth=1.4, full_volume=True)
    mesh = meshes.finger_hexahedra(GEOMETRY, sizing)
    model = body(mesh, Material(1e9, 0.0, 1400.0))
    x, y, curvature = mesh.points[:, 0] + 0.1, mesh.points[:, 1], 1e-3
    bent = np.zeros_like(mesh.points)
    bent[:, 0], bent[:, 1] = -curvature * x * y, 0.5 * curvature * x**2
    reading = model.probe.read(model.kernel, bent, np.zeros_like(bent))
    assert reading == pytest.approx(1e9 * curvature * 0.0075, rel=1e-3)


def test_chord_thickness_gives_the_round_sections_area_and_inertia() -> None:
    radius, errors = 0.0075, []
    for layers in (8, 16, 32):
        mesh = boxes((0.001,), (2 * radius,), (1, layers))
        thickness = chord_thickness(mesh.points, mesh.cells, np.full(len(mesh.cells), radius))
        h = 2 * radius / layers
        gauss = 0.5 * h / np.sqrt(3)
        centre = mesh.points[mesh.cells][..., 1].mean(axis=1)
        lower, upper = thickness[:, :2].mean(axis=1), thickness[:, 2:].mean(axis=1)
        area = 0.5 * h * (lower + upper).sum()
        inertia = 0.5 * h * (lower * (centre - gauss) ** 2 + upper * (centre + gauss) ** 2).sum()
        errors.append(
            [abs(area / (np.pi * radius**2) - 1), abs(inertia / (np.pi * radius**4 / 4) - 1)]
        )
    # sqrt(R^2 - y^2) has an end of order 1/2, so the quadrature converges with h^(3/2).
    assert max(errors[0]) < 0.02
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert ratios == pytest.approx(np.full((2, 2), 2**1.5), rel=0.15)


def test_thinned_record_is_equally_spaced_and_bounded() -> None:
    record: Thinned[int] = Thinned(10)
    for number in range(1, 100):
        record.offer(number - 1)
        assert len(record.items) <= 10
        assert len(set(np.diff(record.items))) <= 1
        assert record.items[0] == 0
        if number >= 10:
            assert len(record.items) >= 5


def test_a_state_between_slip_and_stick_is_the_one_before() -> None:
    """A ratio of 0.96 of Coulomb's is neither: only one below 0.95 sticks."""
    normal = np.full(4, 2.0)
    for between, changes in ((0.96, 0), (0.94, 1)):
        states = slip_states(normal, np.array([1.0, between, between, 1.0]), 0.5, 0.1)
        assert (states["slip_to_stick"], states["stick_to_slip"]) == (changes, changes)
        assert states["reverse_slip"] is False  # it slips, and one way only


def test_a_tap_is_read_from_no_force_to_no_force_and_no_further() -> None:
    """Forces of 1, 1 and 3 N at steps of 1 s between zeros: 5 N s by trapezoids; signs stay."""
    time = np.arange(6.0)
    forces = ForceRecord(
        time, np.array([0.0, 1.0, 1.0, 3.0, 0.0, 9.0]), np.array([0.0, 0.2, 0.0, -0.5, 0.0, 9.0]),
        np.array([1.0, -1.0, -1.0, -1.0, 1.0, -1.0]),
    )  # fmt: skip
    samples: Any = SimpleNamespace(
        time_s=time, stress_R_Pa=np.array([0.0, 3.0, -5.0, 1.0, 0.0, 9.0])
    )
    blank = Summary(wall_time_s=0.0, steps=0, elements=0, time_step_s=1.0)
    summary = summarize(forces, samples, 0.0, None, 3.0, blank)
    assert summary.normal_impulse_N_s == pytest.approx(5.0)
    assert summary.peak_normal_force_N == 3.0
    assert summary.peak_tangential_force_N == -0.5
    assert summary.peak_stress_R_Pa == -5.0
