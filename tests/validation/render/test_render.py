"""``fingertap render``: pictures of a run or a scene, and the mathematics of what they show."""

import json
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from tests.validation.commands import Make, Patch, Run
from validation.errors import UserError
from validation.harness.processes import CrashedError
from validation.harness.run_files import write_run
from validation.render import command as render_command
from validation.render import interactive, off_screen, pictures
from validation.render.details import beyond_rigid
from validation.render.off_screen import PICTURES, Renders, missing_libraries
from validation.render.run_folder import DrawnRun, read_curves, read_steps
from validation.render.views import read_fields, surface
from validation.runs import command as run_command

COARSE = (
    *("--set", "surface.height=0.06", "--set", "solver.fem.section_size=4e-3"),
    *("--set", "solver.fem.axial_size=8e-3", "--set", "solver.fem.tip_size=4e-3"),
)


@pytest.mark.skipif(bool(missing_libraries()), reason="VTK cannot draw here")
@pytest.mark.parametrize(
    ("model", "wanted"), [("fem3d", PICTURES), ("fem2d", ("pressure", "shape"))]
)
def test_a_scene_is_run_and_drawn(
    model: str, wanted: tuple[str, ...], tmp_path: Path, monkeypatch: Patch, fingertap: Run
) -> None:
    from PIL import Image

    monkeypatch.setattr(render_command, "PICTURES", wanted)
    whole = wanted is PICTURES and find_spec("plotly") is not None
    more = ["--interactive"] * whole
    ended = fingertap("render", "soft", "--model", model, *COARSE, *more, "--out", tmp_path)
    assert ended.code == 0
    page = tmp_path / "render" / f"soft-{model}-interactive.html"
    if whole:
        assert str(page) in ended.out
        assert "fem3d contact" in page.read_text()
        page.unlink()
    run = tmp_path / "run" / f"soft-{model}"
    for what in wanted:
        suffix = "gif" if what == "animation" else "png"
        path = tmp_path / "render" / f"soft-{model}-{what}.{suffix}"
        assert str(path) in ended.out
        with Image.open(path) as image:
            if what == "animation":
                assert image.n_frames == len(read_steps(run / "fields"))
                assert image.info["loop"] == 0
            # The body covers a good part of the picture, in many colours.
            colours = np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)
            assert len(colours) > 50, what
    left = {path.name for path in (tmp_path / "render").iterdir()}
    assert len(left) == len(wanted)  # no frames and no temporary files
    # A finished run is drawn again without being run.
    before = (run / "summary.json").read_bytes()
    (tmp_path / "render" / f"soft-{model}-shape.png").unlink()
    monkeypatch.setattr(render_command, "PICTURES", ("shape",))
    assert fingertap("render", run, "--out", tmp_path).code == 0
    assert {path.name for path in (tmp_path / "render").iterdir()} == left
    assert (run / "summary.json").read_bytes() == before
    # and so is its scene, which `fingertap run` knows too
    for more in (["render", "soft"], ["run", "soft"]):
        again = fingertap(*more, "--model", model, *COARSE, "--out", tmp_path)
        assert (again.code, "has this run" in again.err) == (0, True)


@pytest.mark.parametrize(
    ("arguments", "missing", "message"),
    [
        (["nothing"], "", "scene 'nothing': unknown"),
        (["{folder}"], "", "summary.json is missing; give the folder of a fem3d or fem2d run"),
        (["{folder}", "--model", "fem2d"], "", "a finished run takes neither --model nor --set"),
        (["soft", "--model", "hcm"], "", "--model"),
        (["soft"], "libGL cannot be loaded", "cannot draw: libGL cannot be loaded"),
        (["soft", "--interactive"], "plotly", "needs plotly; pip install 'fingertap[interactive]'"),
    ],
)
def test_what_cannot_be_drawn_is_refused_before_anything_runs(
    arguments: list[str], missing: str, message: str, tmp_path: Path, monkeypatch: Patch,
    fingertap: Run,
) -> None:  # fmt: skip
    monkeypatch.setattr(render_command, "missing_libraries", lambda: missing)
    monkeypatch.setattr(interactive, "find_spec", lambda name: None)
    given = [argument.format(folder=tmp_path) for argument in arguments]
    assert message in fingertap("render", *given, "--out", tmp_path / "out").refusal
    if missing:
        assert list(tmp_path.iterdir()) == []


def plain_run(run: Path) -> dict[str, Any]:
    """Write what `render` reads before anything is drawn; returns the summary."""
    (run / "fields").mkdir(parents=True, exist_ok=True)
    (run / "fields" / "tap_000.vtu").touch()
    pvd = '<V><C><DataSet timestep="0.1" file="tap_000.vtu"/></C></V>'
    (run / "fields" / "tap.pvd").write_text(pvd)
    summary: dict[str, Any] = {
        "contact_time_s": 0.1, "peak_normal_force_time_s": None, "scene": "soft",
        "model": "fem3d", "variant": "", "status": "UNSTABLE", "message": "its mesh is wet",
        "provenance": {"scene_toml": "[surface]\nheight = 0.1"},
    }  # fmt: skip
    (run / "summary.json").write_text(json.dumps(summary))
    return summary


SUMMARIES: dict[str, Any] = {
    "contact_time_s": ["x", [], float("nan"), True, 10**400],
    "peak_normal_force_time_s": ["x", {}, float("inf")],
    "provenance": [None, [], {}, {"scene_toml": 3}, {"scene_toml": "["}, {"scene_toml": ""},
                   {"scene_toml": "surface = 3"}, {"scene_toml": "[surface]\nheight = 'x'"}],
}  # fmt: skip
INDICES = ("", "<a>", "<a/>", '<a><DataSet file="x.vtu"/></a>', "\0", "<DataSet/>",
           '<a><DataSet timestep="x" file="tap_000.vtu"/></a>',
           '<a><DataSet timestep="nan" file="tap_000.vtu"/></a>')  # fmt: skip


def test_a_forged_run_is_refused_by_its_file(
    tmp_path: Path, monkeypatch: Patch, fingertap: Run
) -> None:
    monkeypatch.setattr(render_command, "missing_libraries", lambda: "")
    run = tmp_path / "run"
    good = plain_run(run)
    texts = [json.dumps(good | {key: v}) for key, values in SUMMARIES.items() for v in values]
    texts += [json.dumps({k: v for k, v in good.items() if k != key}) for key in good]
    for text in ("", "[]", "3", "[" * 100_000, *texts):
        (run / "summary.json").write_text(text)
        line = fingertap("render", run, "--out", tmp_path / "out").refusal
        assert f"render {run}: summary.json is damaged or not a run's" in line, text[:80]
        assert line.rstrip().endswith("make the run again with fingertap run, or give its scene")
    plain_run(run)
    for text in INDICES:
        (run / "fields" / "tap.pvd").write_text(text)
        line = fingertap("render", run, "--out", tmp_path / "out").refusal
        assert f"render {run}: fields/tap.pvd is damaged or not a run's" in line, text


def test_what_a_run_says_of_itself_is_said_where_it_is_drawn(
    tmp_path: Path, monkeypatch: Patch, fingertap: Run
) -> None:
    """Pictures of a run that failed, or that doubts its numbers, came without a word."""
    monkeypatch.setattr(render_command, "missing_libraries", lambda: "")
    monkeypatch.setattr(render_command, "render_run", lambda *a: Renders({}))
    run, said = tmp_path / "run", "fingertap: caution: {}its mesh is wet\n"
    good = plain_run(run)
    for status, word in (("UNSTABLE", "UNSTABLE: "), ("COMPLETED", "")):
        (run / "summary.json").write_text(json.dumps(good | {"status": status}))
        ended = fingertap("render", run, "--out", tmp_path / "out")
        assert (ended.code, ended.err) == (0, said.format(word))


def test_forces_are_read_back_from_the_first_touch_and_refused_where_damaged(
    make_record: Make, tmp_path: Path
) -> None:
    record = make_record("soft", "fem3d", "contact")
    write_run(tmp_path, record)
    name, (time, normal, tangential) = read_curves(tmp_path)
    assert name == "fem3d contact"
    history = record.history
    np.testing.assert_array_equal(time, history["time_s"] - record.value("contact_time_s"))
    np.testing.assert_array_equal(normal, history["normal_force_N"])
    np.testing.assert_array_equal(tangential, history["tangential_force_N"])
    for text in ("time_s\n1.0\n", "time_s,normal_force_N\n1,x\n"):
        (tmp_path / "curves.csv").write_text(text)
        with pytest.raises(UserError, match=r"curves\.csv is damaged or not a run's"):
            read_curves(tmp_path)
    (tmp_path / "curves.csv").unlink()
    with pytest.raises(UserError, match="which only a completed run has"):
        read_curves(tmp_path)


def test_forged_fields_are_refused_by_their_file(tmp_path: Path) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    good, stress = {"displacement": points, "velocity": points}, {"von_mises_Pa": [np.ones(1)]}
    for number, (of_points, of_cells) in enumerate((
        ({}, stress), (good, {}), (good | {"velocity": points[:, :2]}, stress),
        (good | {"displacement": points * np.nan}, stress),
        (good | {"contact_pressure_Pa": points}, stress),
    )):  # fmt: skip
        path = tmp_path / f"tap_{number:03d}.vtu"
        meshio.Mesh(points, [("quad", [[0, 1, 2, 3]])], of_points, of_cells).write(path)
    (tmp_path / "x.vtu").write_text("no XML")
    forged = list(tmp_path.iterdir())
    assert len(forged) == 6
    for path in forged:
        with pytest.raises(UserError, match="is damaged or not a step of a run"):
            read_fields(path)


def test_a_drawing_that_fails_keeps_what_there_is(
    monkeypatch: Patch, tmp_path: Path, fingertap: Run
) -> None:
    run = tmp_path / "soft-fem3d"
    good = plain_run(run)
    (run / "summary.json").write_text(json.dumps(good | {"status": "COMPLETED", "message": ""}))
    monkeypatch.setattr(render_command, "missing_libraries", lambda: "")
    monkeypatch.setattr(render_command, "render_run", lambda *a: Renders({}, "VTK crashed"))
    ended = fingertap("render", run, "--out", tmp_path)
    assert ended.code == 1
    assert "VTK crashed; pictures so far: " in ended.line


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])


@pytest.mark.parametrize("dim", [2, 3])
def test_rigid_motion_leaves_nothing_and_strain_is_left(dim: int) -> None:
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 5)] * 3, indexing="ij"), axis=-1)
    rest = grid.reshape(-1, 3) * [2.0, 1.0, 0.5 if dim == 3 else 0.0]
    bodies = np.repeat([0, 1], len(rest))
    far, there, back = np.array([[4.0, 0, 0], [1, 2, 0], [0, -5, 0]])
    both = np.vstack([rest, rest + far])
    # Two bodies, each turned and moved in its own way: even past a right angle nothing is left.
    now = np.vstack([turned(rest, 2.0) + there, turned(rest, -0.4) + back])
    assert np.abs(beyond_rigid(both, now, bodies)).max() < 1e-14
    # A symmetric stretch has no rotation: it is left as it is, turned with the body.
    stretch = 1e-3 * rest * [1.0, -0.4, 0.0]
    beyond = beyond_rigid(rest, turned(rest + stretch, 2.0) + 7.0, np.zeros(len(rest)))
    assert beyond == pytest.approx(turned(stretch, 2.0), abs=1e-12)


@pytest.mark.parametrize(("low", "cut", "ends", "cells"), [
    (0.0, True, (-1.0, 0.0), 40),  # the far half, from its mirror
    (0.0, False, (-1.0, 1.0), 80),
    (-1.0, True, (-1.0, 0.0), 24),
    (-1.0, False, (-1.0, 1.0), 40),
])  # fmt: skip
def test_a_whole_body_is_cut_as_a_half_model_is(
    low: float, cut: bool, ends: tuple[float, float], cells: int
) -> None:
    """A block of 2 x 2 x 4 cells: its mirror is none of a whole one's parts."""
    pv = pytest.importorskip("pyvista")
    steps = (0.5, 0.5, (1.0 - low) / 4)
    block = pv.ImageData(dimensions=(3, 3, 5), spacing=steps, origin=(0.0, 0.0, low))
    shown = surface(block.cast_to_unstructured_grid(), cut)
    assert shown.bounds[4:] == pytest.approx(ends)
    assert shown.n_cells == cells


def test_a_run_that_leaves_nothing_to_draw_says_why(
    tmp_path: Path, monkeypatch: Patch, fingertap: Run
) -> None:
    """Files that could not all be written are told, though those that are drawn are there."""
    monkeypatch.setattr(render_command, "missing_libraries", lambda: "")
    scene, own = (
        ("render", "soft", "--model", "fem2d", *COARSE, "--out", tmp_path),
        run_command.keep,
    )
    early = fingertap(*scene, "--set", "solver.fem.end_time=1e-3")
    assert (early.code, "the surface is not reached" in early.err) == (1, True)

    own = run_command.keep

    def cut(*given: Any) -> None:
        own(*given)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(run_command, "keep", cut)
    full = fingertap(*scene)
    assert full.code == 1
    assert "its files could not all be written (No space left on device)" in full.err


def test_pictures_of_an_earlier_run_are_not_shown(tmp_path: Path, monkeypatch: Patch) -> None:
    """`validate` draws under fixed names; where drawing failed, the old ones stood for the new."""

    def fail(*arguments: Any, **named: Any) -> None:
        raise CrashedError("VTK died")

    monkeypatch.setattr(off_screen, "missing_libraries", lambda: "")
    monkeypatch.setattr(off_screen, "call_isolated", fail)
    old = tmp_path / "soft-stress.png"
    old.write_bytes(b"of another run")
    found = off_screen.render_run(tmp_path, tmp_path, "soft", ("stress", "velocity"))
    assert (found.pictures, old.exists()) == ({}, False)
    assert "VTK died" in found.problem


def test_times_on_pictures_tell_steps_apart() -> None:
    """Taps of 2 us had four names for eleven steps, two of them 0 and -0."""
    times = (-2e-8, -1e-9, 5.3e-7, 1.04e-6)
    steps = [(1e-3 + time, Path()) for time in times]
    run = DrawnRun(steps, 1e-3, 1e-3 + times[-1], 0.1, "tiny", "")
    assert run.since_touch() == ["-0.02", "0.00", "0.53", "1.04"]


def test_a_run_without_a_touch_has_no_peak(monkeypatch: Patch) -> None:
    """Its pictures said "peak force", and that 0 MPa were beyond the scale."""
    said: list[str] = []
    monkeypatch.setattr(pictures, "deformed", lambda *a, **b: {pictures.STRESS: np.zeros(3)})
    monkeypatch.setattr(
        pictures, "draw", lambda path, mesh, field, text, *a, **b: said.append(text)
    )
    run = DrawnRun([(0.0, Path()), (1e-3, Path())], None, None, 0.1, "soft", "UNSTABLE")
    pictures.Drawing(run, ()).stress(Path())
    assert said == ["soft\nt = 1000 µs\nlargest 0 MPa"]
    touched = replace(run, contact_s=4e-4, peak_s=7e-4)
    monkeypatch.setattr(pictures, "deformed", lambda *a, **b: {pictures.STRESS: np.arange(1000.0)})
    pictures.Drawing(touched, ()).stress(Path())
    assert said[1:] == ["soft\nt - t_c = 600 µs (peak force)\nlargest 999 MPa, beyond the scale"]
