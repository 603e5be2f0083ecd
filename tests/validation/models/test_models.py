import json
from pathlib import Path

import numpy as np
import pytest
import xarray

from validation.cli import main
from validation.errors import UserError
from validation.models import hcm as hcm_adapter
from validation.models import solid
from validation.render.run_folder import read_steps
from validation.runs.execute import Job, in_fresh_process, solve
from validation.scenes.load import load_scene


def as_json(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, object]:
    main(["run", *arguments, "--json"])
    captured = capsys.readouterr()
    assert captured.err == ""
    result: dict[str, object] = json.loads(captured.out)
    return result


# Design notes, section 5, with the tolerances of issue 2.
@pytest.mark.parametrize(
    ("scene", "peak", "duration"), [("soft", 64.46, 232.4e-6), ("hard", 173.0, 70.9e-6)]
)
def test_reduced_model_gives_the_known_values(
    scene: str, peak: float, duration: float, capsys: pytest.CaptureFixture[str]
) -> None:
    result = as_json(capsys, scene, "--model", "hcm")
    assert result["peak_normal_force_N"] == pytest.approx(peak, rel=1e-3)
    assert result["contact_duration_s"] == pytest.approx(duration, abs=0.5e-6)
    assert result["contact_time_s"] == pytest.approx(0.136107, abs=20e-6)
    assert result["tip_velocity_at_contact_m_per_s"] == pytest.approx([1.8136, -1.6544], rel=1e-3)
    assert result["peak_tangential_force_N"] == pytest.approx(
        -0.5 * float(str(result["peak_normal_force_N"])), rel=1e-6
    )
    assert result["compression_to_restitution"] == 1
    assert result["stick_to_slip"] == result["slip_to_stick"] == 0
    assert result["reverse_slip"] is False
    assert float(str(result["energy_residual"])) < 1e-3


def test_overrides_reach_the_reduced_model(capsys: pytest.CaptureFixture[str]) -> None:
    smooth = as_json(capsys, "soft", "--model", "hcm", "--set", "surface.friction=0")
    assert smooth["peak_tangential_force_N"] in (0, None)
    full = as_json(capsys, "soft", "--model", "hcm")
    lossy = as_json(capsys, "soft", "--model", "hcm", "--set", "tip.restitution=0.8")
    ratio = float(str(lossy["normal_impulse_N_s"])) / float(str(full["normal_impulse_N_s"]))
    assert ratio == pytest.approx(1 - 0.077, abs=5e-4)  # issue 2: 7.7 % below


def test_settings_reach_the_reduced_model() -> None:
    fixed = ["solver.hcm.contact_tolerance=0.0"]
    coarse = solve(load_scene("soft", [*fixed, "solver.hcm.contact_step=1e-6"]), "hcm", None).record
    fine = solve(load_scene("soft", [*fixed, "solver.hcm.contact_step=1e-7"]), "hcm", None).record
    contact = fine.value("contact_duration_s") or 0.0
    # a tenfold step in contact saves nine tenths of its steps of 0.1 us
    saved = (fine.value("steps") or 0) - (coarse.value("steps") or 0)
    assert saved == pytest.approx(0.9 * contact / 1e-7, rel=0.1)


def test_a_torque_upwards_is_a_failed_run_and_is_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    overrides = ("--set", "drive.torques=[-0.5, 0, 0]", "--set", "solver.hcm.max_flight_time=0.01")
    with pytest.raises(SystemExit) as end:
        main(["run", "soft", "--model", "hcm", *overrides, "--out", str(tmp_path)])
    assert end.value.code == 1
    assert capsys.readouterr().err.count("\n") == 1
    folder = tmp_path / "run" / "soft-hcm"
    assert json.loads((folder / "summary.json").read_text())["status"] == "NOT_REACHED"
    assert (folder / "history.nc").is_file()


@pytest.mark.parametrize("model", ["fem2d", "fem3d"])
def test_solid_models_give_whole_records_and_fields(model: str, tmp_path: Path) -> None:
    main(["run", "soft", "--model", model, "--out", str(tmp_path)])
    folder = tmp_path / "run" / f"soft-{model}"
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["variant"] == "fast"
    assert summary["elements"] > 0
    assert summary["energy_residual"] < 0.01
    mu = 0.5
    with xarray.open_dataset(folder / "history.nc", engine="h5netcdf") as data:
        assert float(data.normal_force_N.max()) == pytest.approx(
            summary["peak_normal_force_N"], rel=0.02
        )
        assert float(data.normal_force_N.min()) >= 0
        excess = np.abs(data.tangential_force_N) - mu * data.normal_force_N
        assert float(excess.max()) <= 1e-9 * summary["peak_normal_force_N"]
    steps = read_steps(folder / "fields")
    peak_time = summary["contact_time_s"] + summary["peak_normal_force_time_s"]
    nearest = min(abs(time - peak_time) for time, _ in steps)
    assert nearest < 0.02 * summary["contact_duration_s"]


def test_mesh_sizes_scale_with_the_finger_and_can_be_set() -> None:
    usual = solid.build_mesh(load_scene("soft").tables, 2)
    thin = ["finger.diameter=0.0075", "finger.length=0.02", "surface.height=0.05"]
    half = solid.build_mesh(load_scene("soft", thin).tables, 2)
    assert len(half.cells) == len(usual.cells)
    np.testing.assert_allclose(half.points, usual.points / 2, atol=1e-9)
    coarse = solid.build_mesh(load_scene("soft", ["solver.fem.axial_size=0.01"]).tables, 2)
    assert len(coarse.cells) < len(usual.cells)


@pytest.mark.parametrize(
    ("override", "part"),
    [
        ("drive.reaction=true", "drive.reaction = true"),
        ("solver.fem.section_size=1e-6", "section_size"),
        ("solver.fem.element=tet4", "tet4"),
    ],
)
def test_what_a_solid_model_cannot_take_is_bad_input(override: str, part: str) -> None:
    with pytest.raises(UserError, match=part) as caught:
        solve(load_scene("soft", [override]), "fem2d", None)
    assert "\n" not in str(caught.value)


def test_memory_is_not_charged_for_the_parent(tmp_path: Path) -> None:
    ballast = np.ones(100_000_000)  # 800 MB in this process
    (record,) = in_fresh_process([Job("soft", "hcm")], tmp_path)
    assert record.ok
    assert (record.value("peak_memory_MB") or 0.0) < 500 * ballast[0]


def test_variants_are_named_after_what_was_changed() -> None:
    assert solid.variant(load_scene("soft").tables) == "fast"
    tables = load_scene("soft", ["solver.fem.penalty_factor=0.4"]).tables
    assert solid.variant(tables) == "fast penalty 0.4"


@pytest.mark.parametrize("model", ["hcm", "fem3d", "fem2d"])
def test_the_warm_up_is_a_whole_tap(model: str) -> None:
    """One that stops before contact leaves kernels to be compiled in the run that is timed."""
    warm_up = hcm_adapter.WARM_UP if model == "hcm" else solid.WARM_UP
    record = solve(load_scene("soft", warm_up), model, None).record  # type: ignore[arg-type]
    assert record.ok, record.message
    assert record.summary["contact_duration_s"] is not None
