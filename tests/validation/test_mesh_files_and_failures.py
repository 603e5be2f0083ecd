"""A user's mesh file and a run beyond stability, from the command line: one line, exit code."""

import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray

import meshes
from reference_fem import Snapshot
from tests.validation.commands import Patch, Run, call
from validation.harness.run_files import Fields, write_fields
from validation.models.solid_mesh import build_mesh
from validation.scenes.load import load_scene

COARSE = ("solver.fem.section_size=5e-3", "solver.fem.axial_size=1e-2", "solver.fem.tip_size=5e-3")
LOW = "surface.height=0.06"  # a fall of 52.5 mm, which the last phalanx ends first
GEOMETRY = meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3)
SIZING = meshes.Sizing(5e-3, 1e-2, 5e-3)


def fem(out: Path, *overrides: str, model: str = "fem3d") -> tuple[object, ...]:
    """The command of a run."""
    settings = [text for override in overrides for text in ("--set", override)]
    return ("run", "soft", "--model", model, "--out", out, "--set", LOW, *settings)


@pytest.fixture(scope="module")
def mesh() -> meshes.FingerMesh:
    return meshes.finger_hexahedra(GEOMETRY, SIZING)


def test_a_users_mesh_is_the_mesh_that_runs(
    mesh: meshes.FingerMesh, tmp_path: Path, fingertap: Run
) -> None:
    path = tmp_path / "mine.vtu"
    meshes.write(mesh, path)
    assert fingertap(*fem(tmp_path / "a", f"solver.fem.mesh={path}")).code == 0
    assert fingertap(*fem(tmp_path / "b", *COARSE)).code == 0
    one, two = (
        json.loads((tmp_path / name / "run/soft-fem3d/summary.json").read_text()) for name in "ab"
    )
    assert one["variant"] == "mine"
    for key in ("contact_time_s", "peak_normal_force_N", "normal_impulse_N_s", "steps"):
        assert one[key] == two[key] is not None
    # it stays as it is, and what is asked of it is told
    assert "accuracy" not in one or not one["accuracy"]
    held = fem(tmp_path / "c", f"solver.fem.mesh={path}", "solver.accuracy=5e-3")
    assert "expects a relative error" in fingertap(*held).err
    three = json.loads((tmp_path / "c/run/soft-fem3d/summary.json").read_text())
    assert three["accuracy"]["expected"] > three["accuracy"]["wanted"] == 5e-3
    assert three["peak_normal_force_N"] == one["peak_normal_force_N"]


def test_the_whole_body_of_a_users_mesh_is_its_mirror_image(
    mesh: meshes.FingerMesh, tmp_path: Path
) -> None:
    path = tmp_path / "mine.vtu"
    meshes.write(mesh, path)
    keys = (f"solver.fem.mesh={path}", "solver.fem.symmetry=false")
    whole = build_mesh(load_scene("soft", keys).tables, 3)
    assert len(whole.cells) == 2 * len(mesh.cells)
    assert "symmetry" not in whole.node_sets


Break = Callable[[meshes.FingerMesh], meshes.FingerMesh]


def inverted(mesh: meshes.FingerMesh) -> meshes.FingerMesh:
    cells = mesh.cells.copy()
    cells[7] = cells[7][[4, 5, 6, 7, 0, 1, 2, 3]]
    return dataclasses.replace(mesh, cells=cells)


def one_twice(mesh: meshes.FingerMesh) -> meshes.FingerMesh:
    of = {name: members.copy() for name, members in mesh.cell_sets.items()}
    last = f"phalanx_{mesh.phalanges}"
    twice = of[last][len(of[last]) // 2]
    of[last] = np.append(of[last], len(mesh.cells))
    cells = np.vstack([mesh.cells, mesh.cells[twice]])
    return dataclasses.replace(mesh, cells=cells, cell_sets=of)


def without_tip(mesh: meshes.FingerMesh) -> meshes.FingerMesh:
    nodes = {name: members for name, members in mesh.node_sets.items() if name != "pole"}
    return dataclasses.replace(mesh, node_sets=nodes)


def all_nodes_in_a_hinge(mesh: meshes.FingerMesh) -> meshes.FingerMesh:
    nodes = {**mesh.node_sets, "hinge_2_proximal": np.arange(len(mesh.points))}
    return dataclasses.replace(mesh, node_sets=nodes)


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (inverted, r"1 of \d+ elements cannot be used \(1 inverted.*element 7 "),
        (one_twice, r"[1-6] sides belong to three elements or more; remove duplicate"),
        (without_tip, "missing or empty: node set pole"),
        (
            lambda m: dataclasses.replace(m, points=1e3 * m.points),
            r"phalanx 1 is 40 m long, .* is 0.04; coordinates are in metres",
        ),
        (lambda m: dataclasses.replace(m, points=2 * m.points), r"0.08 m long.*is 0.04"),
        (lambda m: dataclasses.replace(m, points=m.points * [1, 0.5, 0.5]), r"m thick, .* 0.015"),
        (all_nodes_in_a_hinge, "node set hinge_2_proximal: lacks 0 .* and holds"),
    ],
    ids=[
        "inverted",
        "an element twice",
        "missing set",
        "millimetres",
        "another finger",
        "half as thick",
        "all nodes",
    ],
)
def test_bad_mesh_files_end_with_one_line(
    broken: Break, message: str, mesh: meshes.FingerMesh, tmp_path: Path, fingertap: Run
) -> None:
    path = tmp_path / "bad.vtu"
    meshes.write(broken(mesh), path)
    line = fingertap(*fem(tmp_path, f"solver.fem.mesh={path}")).refusal
    assert f"solver.fem.mesh = {path}" in line
    assert re.search(message, line)
    assert not list(tmp_path.glob("run/*/summary.json"))


@pytest.mark.parametrize(
    ("name", "overrides", "model", "message"),
    [
        ("cut.msh", (), "fem3d", "unreadable or truncated"),
        ("none.vtu", (), "fem3d", "none.vtu: no such file"),
        ("whole.vtu", (), "fem2d", "is a 3D mesh; use --model fem3d"),
        ("whole.vtu", ("finger.phalanges=2", "drive.gravity=9"), "fem3d",
         "has 3 phalanges, the finger has 2"),
        ("whole.vtu", ("solver.fem.halvings=2",), "fem3d",
         "solver.fem.halvings = 2: has no effect on a mesh from a file"),
        ("whole.vtu", ("solver.fem.tip_size=1e-3",), "fem3d",
         "solver.fem.tip_size = 0.001: has no effect on a mesh from a file"),
    ],
)  # fmt: skip
def test_truncated_missing_and_plane_mesh_files(
    name: str, overrides: tuple[str, ...], model: str, message: str, mesh: meshes.FingerMesh,
    tmp_path: Path, fingertap: Run,
) -> None:  # fmt: skip
    path = tmp_path / name
    if name != "none.vtu":
        meshes.write(mesh, path)
    if name == "cut.msh":
        path.write_bytes(path.read_bytes()[:-2000])
    ended = fingertap(*fem(tmp_path, f"solver.fem.mesh={path}", *overrides, model=model))
    assert message in ended.refusal


def test_step_beyond_stability_is_stopped_and_kept(tmp_path: Path, fingertap: Run) -> None:
    ended = fingertap(*fem(tmp_path, *COARSE, "solver.fem.step_factor=1.2"))
    assert ended.code == 1
    line = ended.line
    assert re.search(r"energy balance is off by .* at step \d+, t = [\d.]+ s, with a step of", line)
    assert line.count("lower solver.fem.step_factor") == 1
    folder = tmp_path / "run" / "soft-fem3d"
    assert f"partial results are in {folder}" in line
    assert json.loads((folder / "summary.json").read_text())["status"] == "UNSTABLE"
    with xarray.open_dataset(folder / "history.nc", engine="h5netcdf") as history:
        assert len(history.time) >= 2
        assert np.isfinite(history.kinetic_energy_J).all()
    assert (folder / "fields" / "tap.pvd").is_file()
    assert not (folder / "restart.npz").exists()


def test_what_overflows_ends_as_a_status_without_a_warning(
    tmp_path: Path, fingertap: Run, recwarn: pytest.WarningsRecorder
) -> None:
    wild = (*COARSE, "drive.torques=[1e6, 1e6, 1e6]", "drive.gravity=1e4", "surface.height=0.1")
    ended = fingertap(*fem(tmp_path, *wild, model="fem2d"))
    assert ended.code == 1
    # by which of the two it is told depends on how many steps lie between two audits
    assert "no longer finite at step" in ended.line or "energy balance is off" in ended.line
    assert not [str(warning.message) for warning in recwarn]


def test_any_penalty_keeps_the_step_stable(tmp_path: Path, fingertap: Run) -> None:
    # The contact stiffness enters the stable step: a penalty of 1000 costs steps. At 0.9 of that
    # step a node stays for two of them, and by where between two steps it arrives it gains or
    # loses up to twice its speed (tests/reference_fem/test_contact.py), so that round-off decides
    # how the tap goes on; at 0.2 of it an impact is known to 1 %, and the tap's energy is kept.
    springs = ("solver.fem.contact=penalty", "solver.fem.penalty_factor=1000")
    stiff = (*COARSE, *springs)
    assert fingertap(*fem(tmp_path, *stiff, "solver.fem.step_factor=0.2")).code == 0
    summary = json.loads((tmp_path / "run/soft-fem3d/summary.json").read_text())
    assert summary["status"] == "COMPLETED"
    assert summary["energy_residual"] < 0.01
    # Above the stable step it can't be.
    assert fingertap(*fem(tmp_path, *stiff, "solver.fem.step_factor=1.2")).code == 1
    summary = json.loads((tmp_path / "run/soft-fem3d/summary.json").read_text())
    assert summary["status"] == "UNSTABLE"


@pytest.mark.parametrize("name", ["driven-2", "driven-3"])
def test_strong_torques_fly_explicitly(name: str) -> None:
    # They bend the phalanges before they touch: a rigid flight would be another scene's.
    assert load_scene(name).tables.solver.fem.flight == "explicit"
    assert load_scene("soft").tables.solver.fem.flight is None


# The rest reads back what the first run of this file would leave.
@pytest.fixture(scope="module", params=["fem3d", "fem2d"])
def run_folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("fields")
    assert call(*fem(out, *COARSE, model=request.param)) == 0
    return out / "run" / f"soft-{request.param}"


def test_fields_open_in_paraviews_reader_and_in_meshio(run_folder: Path) -> None:
    import meshio
    import pyvista as pv

    dim = 3 if run_folder.name.endswith("3d") else 2
    sizing = load_scene("soft", COARSE).tables.solver.fem
    build = meshes.finger_hexahedra if dim == 3 else meshes.finger_quadrilaterals
    mesh = build(GEOMETRY, meshes.Sizing(sizing.section_size, sizing.axial_size, sizing.tip_size))
    reader = pv.get_reader(run_folder / "fields" / "tap.pvd")
    times = reader.time_values
    assert len(times) >= 8
    assert times == sorted(times)
    summary = json.loads((run_folder / "summary.json").read_text())
    assert times[0] < summary["contact_time_s"] < times[-1]
    files = sorted((run_folder / "fields").glob("*.vtu"))
    assert len(files) == len(times)
    for number, (time, file) in enumerate(zip(times, files, strict=True)):
        reader.set_active_time_value(time)
        (grid,) = reader.read()
        other = meshio.vtu.read(file)
        assert grid.n_points == len(mesh.points) == len(other.points)
        assert grid.n_cells == len(mesh.cells) == len(other.cells[0].data)
        assert np.array_equal(grid.points[:, :dim], mesh.points)
        assert np.array_equal(other.cells[0].data, mesh.cells)
        assert {"displacement", "velocity", "contact_pressure_Pa"} <= set(grid.point_data.keys())
        for name, values in other.point_data.items():
            assert np.array_equal(grid.point_data[name], values)
            assert np.isfinite(values).all()
        stress = grid.cell_data["von_mises_Pa"]
        assert np.array_equal(other.cell_data["von_mises_Pa"][0], stress)
        assert (stress.min() >= 0.0) & (number == 0 or stress.max() > 0.0)


def test_history_opens_in_xarray(run_folder: Path) -> None:
    summary = json.loads((run_folder / "summary.json").read_text())
    with xarray.open_dataset(run_folder / "history.nc", engine="h5netcdf") as history:
        assert history.normal_force_N.attrs["units"] == "N"
        assert history.time_s.attrs["units"] == "s"
        assert history.tip_position_m.dims[0] == "time"
        peak = float(history.normal_force_N.max())
        assert peak == pytest.approx(summary["peak_normal_force_N"], rel=0.02)
        tap = history.normal_force_N.values > 0
        contact = history.time_s.values[tap]
        assert contact[0] == pytest.approx(summary["contact_time_s"], abs=2e-5)
        assert json.loads(history.attrs["summary_json"])["steps"] == summary["steps"]


def test_fields_files_come_whole_or_not_at_all(tmp_path: Path, monkeypatch: Patch) -> None:
    import meshio

    points = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    step = Snapshot(0.1, 0 * points, 0 * points, np.zeros(1), np.zeros(4))
    fields = Fields(points, np.array([[0, 1, 2, 3]]), (step,))

    def fail(*_: object, **__: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(meshio.Mesh, "write", fail)
    with pytest.raises(OSError, match="disk full"):
        write_fields(tmp_path, fields)
    assert list(tmp_path.iterdir()) == []
