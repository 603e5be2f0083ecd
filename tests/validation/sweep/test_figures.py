"""A sweep's figures, read back from their axes."""

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import xarray
from matplotlib import pyplot as plt

from validation.harness.quantities import quantity
from validation.sweep.dataset import Output, Pair, differences
from validation.sweep.figures import draw_distribution, draw_map, draw_parity

PAIR = Pair(0, 1, "own against base")
OWN, BASE = (1.106, -0.6, 40.0, 2.0), (-0.867, -0.5, 50.0, 2.0)  # stresses, MPa


def swept(impulses: Sequence[float]) -> xarray.Dataset:
    """Scenes whose impulses are those over 1 N s, and whose stresses are OWN and BASE."""
    tap = np.array([[number, 1.0] for number in impulses])
    names = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s")
    data = dict.fromkeys(names, (("scene", "model"), tap))
    stress = np.resize(1e6 * np.array([OWN, BASE]).T, tap.shape)
    data["peak_stress_R_Pa"] = (("scene", "model"), stress)
    data["status"] = (("scene", "model"), np.full(tap.shape, "COMPLETED"))
    return xarray.Dataset(data, {"scene": np.arange(len(tap))})


@pytest.mark.usefixtures("figures_kept")
def test_a_stress_keeps_its_sign_in_numbers_and_in_parity(tmp_path: Path) -> None:
    """Parity had magnitudes: 1.106 against -0.867 MPa lay near the line, and differed by 228 %."""
    data = swept((1.0, 1.0, 1.0, 1.0))
    apart = differences(data, quantity("peak_stress_R_Pa"), PAIR)
    # below -1: the other sign; of equal signs negative is smaller in magnitude
    assert apart == pytest.approx([-1.973 / 0.867, 0.2, -0.2, 0.0])
    draw_parity(tmp_path / "parity.png", data, PAIR, ["own", "base"])
    *_, axis = plt.gcf().axes
    points, equal, *zeros = axis.lines
    assert points.get_xydata() == pytest.approx(np.array([BASE, OWN]).T)
    assert equal.get_xdata() == pytest.approx([-0.867, 50.0])
    assert len(zeros) == 2  # the quadrants
    assert axis.get_xscale() == axis.get_yscale() == "symlog"


@pytest.mark.usefixtures("figures_kept")
def test_a_single_scenes_distribution_is_a_step(tmp_path: Path) -> None:
    draw_distribution(tmp_path / "d.png", swept([1.02]), [PAIR])
    _, axis, *_ = plt.gcf().axes
    assert axis.lines[0].get_xydata() == pytest.approx(np.array([[2.0, 0.0], [2.0, 100.0]]))


@pytest.mark.usefixtures("figures_kept")
@pytest.mark.parametrize("highest", [0.022, 0.045, 0.15, 0.5, 3.0, 1e4])
def test_labels_of_differences_do_not_run_together(highest: float, tmp_path: Path) -> None:
    """Between decades each tick had its power of ten."""
    data = swept(1.0 + np.geomspace(0.019, highest, 20))
    draw_distribution(tmp_path / "d.png", data, [PAIR])
    _, axis, *_ = plt.gcf().axes
    low, high = axis.get_xlim()
    labels = [*axis.get_xticklabels(), *axis.get_xticklabels(minor=True)]
    shown = [x for x in labels if x.get_text() and low <= x.get_position()[0] <= high]
    boxes = [label.get_window_extent() for label in shown]
    assert len(boxes) > 1
    for left, right in itertools.pairwise(boxes):
        assert left.x1 + 0.5 * left.height < right.x0


@pytest.mark.usefixtures("figures_kept")
def test_bars_and_names_are_of_their_own_axis(tmp_path: Path) -> None:
    data = swept((1.0, 1.1))
    errors = (("scene", "model"), np.array([[0.1, 0.3], [0.2, 0.4]]))
    draw_parity(
        tmp_path / "p.png", data.assign(normal_impulse_N_s_error=errors), PAIR, ["own", "base"]
    )
    _, axis, *_ = plt.gcf().axes
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("base", "own")
    _, _, (across, up) = axis.containers[0].lines
    ends = [np.ptp(np.array(bars.get_segments()), axis=1) for bars in (across, up)]
    assert ends[0] == pytest.approx(np.array([[600.0, 0.0], [800.0, 0.0]]))  # mN s, base's
    assert ends[1] == pytest.approx(np.array([[0.0, 200.0], [0.0, 400.0]]))


@pytest.mark.usefixtures("figures_kept")
def test_a_maps_axis_is_as_its_points_are_drawn(tmp_path: Path) -> None:
    columns = {
        "material.youngs_modulus": np.geomspace(1e7, 1e11, 9),
        "surface.friction": np.linspace(0.01, 1.2, 9),
    }
    draw_map(tmp_path / "m.png", columns, Output("a", "b", np.arange(9.0), signed=False))
    axis = plt.gcf().axes[0]
    assert (axis.get_xscale(), axis.get_yscale()) == ("log", "linear")


@pytest.mark.usefixtures("figures_kept")
def test_a_map_is_red_where_ours_is_more_and_blue_alike_where_it_is_less(tmp_path: Path) -> None:
    columns = {"a": np.array([0.0, 1.0, 2.0]), "b": np.array([5.0, 3.0, 4.0])}
    apart = Output("a", "b", np.array([-1.0, 0.0, 2.0]), signed=True)
    draw_map(tmp_path / "m.png", columns, apart)
    (shown,) = plt.gcf().axes[0].collections
    np.testing.assert_allclose(shown.get_offsets(), np.array([columns["a"], columns["b"]]).T)
    low, high = shown.get_clim()
    assert low == -high
    less, none, more = shown.to_rgba([low, 0.0, high])[:, [0, 2]]  # red and blue
    assert less[1] > less[0]
    assert more[0] > more[1]
    assert none[0] == pytest.approx(none[1], abs=0.01)


@pytest.mark.usefixtures("figures_kept")
def test_a_map_of_compressions_takes_all_of_its_colours(tmp_path: Path) -> None:
    columns = {"a": np.linspace(0.0, 1.0, 101)}
    draw_map(tmp_path / "m.png", columns, Output("a", "b", columns["a"] - 3.0, signed=False))
    (shown,) = plt.gcf().axes[0].collections
    assert shown.get_clim() == pytest.approx((-3.0, -2.02))  # but for the two largest of a hundred


@pytest.mark.usefixtures("figures_kept")
def test_a_scene_counts_from_its_own_difference_on(tmp_path: Path) -> None:
    """Of 1, 2 and 4 % a half each lies below neither: 0 below 1 %, a third from there on."""
    draw_distribution(tmp_path / "d.png", swept([1.01, 1.02, 1.04]), [PAIR])
    _, axis, *_ = plt.gcf().axes
    (line,) = axis.lines
    assert line.get_drawstyle() == "steps-post"
    assert line.get_ydata() == pytest.approx(100.0 / 3.0 * np.arange(4))
    assert line.get_xdata() == pytest.approx([1.0, 1.0, 2.0, 4.0])
