"""``fingertap render``: pictures of a run or a scene, and the mathematics of what they show."""

import json
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from tests.validation.commands import call, one_line
from validation.errors import UserError
from validation.render import command as render_command
from validation.render.details import beyond_rigid
from validation.render.off_screen import PICTURES, Renders, missing_libraries
from validation.render.run_folder import read_steps
from validation.render.views import read_fields

COARSE = (
    *("--set", "surface.height=0.06", "--set", "solver.fem.section_size=4e-3"),
    *("--set", "solver.fem.axial_size=8e-3", "--set", "solver.fem.tip_size=4e-3"),
)


@pytest.mark.skipif(bool(missing_libraries()), reason="VTK cannot draw here")
@pytest.mark.parametrize(
    ("model", "wanted"), [("fem3d", PICTURES), ("fem2d", ("pressure", "shape"))]
)
def test_a_scene_is_run_and_drawn(
    model: str,
    wanted: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    from PIL import Image

    monkeypatch.setattr(render_command, "PICTURES", wanted)
    assert call("render", "soft", "--model", model, *COARSE, "--out", str(tmp_path)) == 0
    printed = capsys.readouterr().out
    run = tmp_path / "run" / f"soft-{model}"
    for what in wanted:
        suffix = "gif" if what == "animation" else "png"
        path = tmp_path / "render" / f"soft-{model}-{what}.{suffix}"
        assert str(path) in printed
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
    assert call("render", str(run), "--out", str(tmp_path)) == 0
    assert {path.name for path in (tmp_path / "render").iterdir()} == left
    assert (run / "summary.json").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nothing"], "scene 'nothing': unknown"),
        (["{folder}"], "summary.json is missing; give the folder of a fem3d or fem2d run"),
        (["{folder}", "--model", "fem2d"], "a finished run takes neither --model nor --set"),
        (["soft", "--model", "hcm"], "--model"),
    ],
)
def test_what_cannot_be_drawn(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(render_command, "missing_libraries", lambda: "")
    given = [argument.format(folder=tmp_path) for argument in arguments]
    assert call("render", *given, "--out", str(tmp_path / "out")) == 2
    assert message in one_line(capsys)


def test_a_machine_that_cannot_draw_is_told_before_anything_runs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(render_command, "missing_libraries", lambda: "libGL cannot be loaded")
    assert call("render", "soft", "--out", str(tmp_path)) == 2
    assert "cannot draw: libGL cannot be loaded" in one_line(capsys)
    assert list(tmp_path.iterdir()) == []


def plain_run(run: Path) -> dict[str, Any]:
    """Write what `render` reads before anything is drawn; returns the summary."""
    (run / "fields").mkdir(parents=True, exist_ok=True)
    (run / "fields" / "tap_000.vtu").touch()
    pvd = '<V><C><DataSet timestep="0.1" file="tap_000.vtu"/></C></V>'
    (run / "fields" / "tap.pvd").write_text(pvd)
    summary: dict[str, Any] = {
        "contact_time_s": 0.1, "peak_normal_force_time_s": None, "scene": "soft",
        "model": "fem3d", "variant": "", "provenance": {"scene_toml": "[surface]\nheight = 0.1"},
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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(render_command, "missing_libraries", lambda: "")
    run = tmp_path / "run"
    good = plain_run(run)
    texts = [json.dumps(good | {key: v}) for key, values in SUMMARIES.items() for v in values]
    texts += [json.dumps({k: v for k, v in good.items() if k != key}) for key in good]
    for text in ("", "[]", "3", "[" * 100_000, *texts):
        (run / "summary.json").write_text(text)
        assert call("render", str(run), "--out", str(tmp_path / "out")) == 2, text[:80]
        line = one_line(capsys)
        assert f"render {run}: summary.json is damaged or no run's" in line, text[:80]
        assert line.rstrip().endswith("make the run again with fingertap run, or give its scene")
    plain_run(run)
    for text in INDICES:
        (run / "fields" / "tap.pvd").write_text(text)
        assert call("render", str(run), "--out", str(tmp_path / "out")) == 2, text
        assert f"render {run}: fields/tap.pvd is damaged or no run's" in one_line(capsys)


def test_forged_fields_are_refused_by_their_file(tmp_path: Path) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    good = {"displacement": points, "velocity": points}
    stress = np.ones(1)
    for number, (of_points, of_cells) in enumerate((
        ({}, stress), (good, None), (good | {"velocity": points[:, :2]}, stress),
        (good | {"displacement": points * np.nan}, stress),
        (good | {"contact_pressure_Pa": points}, stress),
    )):  # fmt: skip
        path = tmp_path / f"tap_{number:03d}.vtu"
        cells = {} if of_cells is None else {"von_mises_Pa": [of_cells]}
        meshio.Mesh(points, [("quad", [[0, 1, 2, 3]])], of_points, cells).write(path)
        with pytest.raises(UserError, match="is damaged or no step of a run"):
            read_fields(path)
    (tmp_path / "x.vtu").write_text("no XML")
    with pytest.raises(UserError, match="is damaged or no step of a run"):
        read_fields(tmp_path / "x.vtu")


def test_a_drawing_that_fails_keeps_what_there_is(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "soft-fem3d"
    (run / "fields").mkdir(parents=True)
    plain_run(run)
    monkeypatch.setattr(render_command, "missing_libraries", lambda: "")
    monkeypatch.setattr(render_command, "render_run", lambda *a: Renders({}, "VTK crashed"))
    assert call("render", str(run), "--out", str(tmp_path)) == 1
    assert "VTK crashed; pictures so far: " in one_line(capsys)


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
