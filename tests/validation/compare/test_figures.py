"""What is drawn, read back from the axes and from the notebook's line."""

import itertools
import re
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from matplotlib import pyplot as plt

import hcm.results.notebook
import reference_fem.results.notebook
from tests.validation.commands import Make
from validation.compare.differences import differences_of
from validation.compare.figures import (
    LOOKS,
    SEEN,
    assumption_bars,
    difference_figure,
    looks,
    overlay_figure,
)
from validation.harness.page import LARGEST_VECTOR, inline


@pytest.mark.usefixtures("figures_kept")
def test_the_residual_is_the_difference_over_the_references_peak(
    make_record: Make, tmp_path: Path
) -> None:
    model, reference = make_record(peak=60.0), make_record("soft", "fem3d", "contact", 80.0)
    pairs = {"soft": [(reference, model)]}
    overlay_figure(tmp_path / "f.png", [model, reference], (), ("soft", "hard"), pairs)
    below, empty = plt.gcf().axes[2:]
    time, residual = below.lines[0].get_data()
    # two half sines over 0.2 ms: (60 - 80)/80 sin(pi t/T); linear between 2,000 samples
    np.testing.assert_allclose(residual, -25.0 * np.sin(np.pi * time / 0.2), atol=1e-4)
    assert len(empty.lines) == 1  # zero
    # forces over ms from the touch, N, to a little beyond the tap
    forces = plt.gcf().axes[0]
    assert forces.get_xlim() == pytest.approx((-0.008, 0.224))
    normal, tangential = forces.lines[:2]
    top = int(np.argmax(normal.get_ydata()))
    assert normal.get_xdata()[top] == pytest.approx(0.1, abs=2e-4)
    assert normal.get_ydata()[top] == pytest.approx(60.0, rel=1e-5)
    assert np.min(tangential.get_ydata()) == pytest.approx(-30.0, rel=1e-5)


@pytest.mark.usefixtures("figures_kept")
def test_a_band_spans_the_forces_of_its_meshes(make_record: Make, tmp_path: Path) -> None:
    band = [make_record("soft", "fem3d", name, peak) for name, peak in (("a", 60.0), ("b", 70.0))]
    overlay_figure(tmp_path / "f.png", [make_record()], band, ("soft",), {})
    shade = plt.gcf().axes[0].collections[0]
    x, y = shade.get_paths()[0].vertices.T
    middle = np.abs(x - 0.1) < 1e-3  # ms
    assert (y[middle].min(), y[middle].max()) == pytest.approx((60.0, 70.0), rel=1e-3)


@pytest.mark.usefixtures("figures_kept")
def test_models_of_ones_own_and_data_are_told_apart(make_record: Make, tmp_path: Path) -> None:
    """All of them were the same thin grey line."""
    mine = [make_record("soft", f"mine-{n}") for n in range(12)]
    data = make_record("soft", "lab.csv", provenance={"data": {}})
    data.history["tangential_force_N"][:] = np.nan  # a file may have none
    runs = [make_record(), *mine[:3], data]
    overlay_figure(tmp_path / "f.png", runs, (), ("soft",), {"soft": [(data, mine[1])]})
    forces, below = plt.gcf().axes
    lines = forces.lines[:-1:2]  # F_n, without F_t and zero
    assert [line.get_label() for line in lines] == [run.label for run in runs]
    *drawn, dots = [(line.get_color(), line.get_linestyle(), line.get_marker()) for line in lines]
    assert len({color for color, _, _ in drawn}) == len({(c, s) for c, s, _ in drawn}) == 4
    assert dots[0] not in {color for color, _, _ in drawn}
    assert dots[1:] == ("None", "o")
    assert below.lines[0].get_color() == lines[2].get_color()
    # the same whoever comes after; no two alike, none like one that we know
    every = looks([*runs[:-1], *mine, make_record("soft", "fem3d", "fast")])
    assert {label: every[label] for label in looks(runs[:-1])} == looks(runs[:-1])
    assert len({look[:2] for look in (*every.values(), *LOOKS.values())}) == 12 + len(LOOKS)


@pytest.mark.usefixtures("figures_kept")
@pytest.mark.parametrize("duration", [0.8e-4, 1.72e-4, 1.1e-3])
def test_times_below_the_forces_do_not_run_together(
    duration: float, make_record: Make, tmp_path: Path
) -> None:
    overlay_figure(tmp_path / "f.png", [make_record(duration=duration)], (), ("soft",))
    (axis,) = plt.gcf().axes
    low, high = axis.get_xlim()
    shown = [x for x in axis.get_xticklabels() if low <= x.get_position()[0] <= high]
    boxes = [label.get_window_extent() for label in shown]
    assert len(boxes) > 2
    for left, right in itertools.pairwise(boxes):
        assert left.x1 + 2.0 * left.height < right.x0


def test_dollars_in_the_names_of_files_are_no_formulas(make_record: Make, tmp_path: Path) -> None:
    named = [make_record("soft", name) for name in (r"a$\frac$b.csv", "hcm")]
    overlay_figure(tmp_path / "f.png", named, (), ("soft",), {"soft": [(named[0], named[1])]})
    assert (tmp_path / "f.png").stat().st_size > 1000


@pytest.mark.usefixtures("figures_kept")
@pytest.mark.parametrize("scenes", [("soft",), ("soft", "hard")])
def test_the_legend_lies_within_the_figure(
    scenes: tuple[str, ...], make_record: Make, tmp_path: Path
) -> None:
    runs = [make_record("soft", "fem3d", f"{n} ls-dyna-like") for n in range(5)]
    overlay_figure(tmp_path / "f.png", runs, (), scenes)
    (legend,) = plt.gcf().legends
    box, whole = legend.get_window_extent(), plt.gcf().bbox
    assert 0.0 <= box.x0 < box.x1 <= whole.x1
    assert 0.0 <= box.y0 < box.y1 <= whole.y1


@pytest.mark.usefixtures("figures_kept")
def test_points_are_differences_and_bars_their_uncertainty(
    make_record: Make, tmp_path: Path
) -> None:
    stated = {"peak_normal_force_N": 1.6}  # 2 % of 80 N, of both: sqrt(8) %
    model = replace(make_record(peak=60.0), errors=stated)
    reference = replace(make_record("soft", "fem3d", "", 80.0), errors=stated)
    rows = differences_of("soft", "hcm", model, reference)
    refined = [replace(row, model="hcm-refined", reduced=row.reference) for row in rows]
    middle = [replace(row, model="+ shear", reduced=0.9 * row.reference) for row in rows]
    stairs = [[replace(row, model="paper") for row in rows], middle]
    names = {"hcm": "hcm, 5 ms", "hcm-refined": "refined", "": "fem3d"}
    difference_figure(tmp_path / "d.png", [*rows, *refined], stairs, names)
    for axis, apart, known in zip(
        plt.gcf().axes, (-25.0, -25.0, 0.0), (np.sqrt(8.0), 0.0, 0.0), strict=True
    ):
        (errors,) = (found for found in axis.containers if hasattr(found, "has_xerr"))
        points, _, (bars,) = errors.lines
        assert points.get_xdata() == pytest.approx([apart, 0.0])
        assert list(points.get_ydata()) == [0, -2]  # the step stands between them
        lengths = [np.ptp(segment[:, 0]) for segment in bars.get_segments()]
        assert lengths[0] == pytest.approx(2 * known)
        _, step, _ = axis.patches
        assert (step.get_x(), step.get_width()) == pytest.approx((apart, -10.0 - apart))
    names_shown = [label.get_text() for label in plt.gcf().axes[0].get_yticklabels()]
    assert names_shown == ["hcm, 5 ms", "+ shear", "refined"]


@pytest.mark.usefixtures("figures_kept")
@pytest.mark.parametrize("run", [True, False])
def test_axes_of_no_difference_can_be_read(make_record: Make, tmp_path: Path, run: bool) -> None:
    """Limits of 1e-17 would leave a single model no height for its points."""
    reference = make_record()
    rows = differences_of("soft", "hcm", reference if run else None, reference)
    difference_figure(tmp_path / "d.png", rows, [], {"hcm": "hcm", "": "fem3d"})
    for axis in plt.gcf().axes:
        assert axis.get_xlim() == (-SEEN, SEEN)


@pytest.mark.usefixtures("figures_kept")
def test_bars_left_out_are_set_apart(tmp_path: Path) -> None:
    _, axes = plt.subplots(1, 2)
    values = [[1.0, 2.0], [3.0, np.nan], [5.0, 6.0]]
    assert assumption_bars(axes, ["a", "b"], ["x", "y_z", "w"], values, 2) == [0, -1, -3]
    assert [bar.get_width() for bar in axes[0].patches] == [1.0, 3.0, 5.0]
    first, second, apart = (bar.get_facecolor() for bar in axes[0].patches)
    assert first == second != apart
    assert [label.get_text() for label in axes[0].get_yticklabels()] == ["x", "y z", "w"]


def test_a_page_holds_small_vectors_and_large_ones_as_pixels(tmp_path: Path) -> None:
    picture, vector = tmp_path / "f.png", tmp_path / "f.svg"
    picture.write_bytes(b"P")
    assert inline(picture) == "data:image/png;base64,UA=="
    vector.write_bytes(b"V")
    assert inline(picture) == "data:image/svg+xml;base64,Vg=="
    vector.write_bytes(b"V" * (LARGEST_VECTOR + 1))
    assert inline(picture) == "data:image/png;base64,UA=="


@pytest.mark.parametrize("module", [hcm.results.notebook, reference_fem.results.notebook])
def test_a_notebook_shows_numbers_curve_and_cautions(make_record: Make, module: ModuleType) -> None:
    errors = {"peak_normal_force_N": 0.5, "contact_duration_s": 1e-6}
    record = replace(make_record(peak=60.0, duration=2.0123e-4), errors=errors)
    forces = record.contact_forces
    shown = module.run_html(
        ("COMPLETED", "a < b"), record.summary, record.errors,
        forces["time_s"], forces["normal_force_N"],
    )  # fmt: skip
    assert "<th>peak_normal_force_N<td>60<td>0.5<" in shown
    assert "<th>contact_duration_s<td>0.0002012<td>1e-06<" in shown
    assert "<p>a &lt; b</p>" in shown
    assert "elements" not in shown  # hcm has none
    assert "peak 60 N" in shown
    line = re.search(r"points='([^']+)'", shown)
    assert line is not None
    x, y = np.array([point.split(",") for point in line[1].split()], dtype=float).T
    t, f = (forces[name][forces["normal_force_N"] > 0.0] for name in ("time_s", "normal_force_N"))
    force = np.interp(x, 480.0 * (t - t[0]) / (t[-1] - t[0]), f)
    # pixels have one decimal, in x as in y, where the half sine rises by 1 pixel a pixel
    np.testing.assert_allclose(y, 140.0 * (1.0 - force / 60.0), atol=0.15)
    assert "<svg" not in module.run_html((), {}, {}, np.zeros(3), np.zeros(3))
    if module is hcm.results.notebook:
        assert "peak 60 N" in record._repr_html_()
