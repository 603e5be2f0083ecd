"""What is refined, what the preset is off by, and the files of a small study."""

import itertools
import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest
from matplotlib import pyplot as plt

import meshes
import reference_fem
from reference_fem.cautions import SPIKED
from tests.validation.commands import Run, asking
from validation.compare.grid_convergence import Convergence, convergence
from validation.converge import command
from validation.converge.command import draw, run_converge
from validation.converge.refinement_runs import CAUTIONS, KEPT, PEAKS, LevelRuns
from validation.converge.refinements import (
    PENALTY,
    SHAFT_MESH,
    TIP_MESH,
    TIP_PRESSED,
    LevelKeys,
    check_given,
    refinements,
)
from validation.converge.verdicts import RefinedRuns, cautions, preset_rows, verdict_rows
from validation.errors import UserError
from validation.harness.quantities import OF_A_TAP
from validation.harness.store import VALUES, Store
from validation.models import solid_inputs
from validation.models.solid_mesh import sizing_of
from validation.scenes.load import load_scene

FINGER = meshes.FingerGeometry((0.05, 0.04, 0.03), (0.015,) * 3)


def test_refinements_change_one_thing_each() -> None:
    for quick in (False, True):
        for refinement in refinements(1.0, 5e-4, quick):
            sizes, (first, *_) = list(refinement.levels), refinement.levels.values()
            assert len(sizes) >= 3
            assert all(fine < coarse for coarse, fine in itertools.pairwise(sizes))
            changing = {
                key
                for overrides in refinement.levels.values()
                for key, value in overrides.items()
                if value != first[key]
            }
            assert (
                changing
                == {
                    TIP_MESH: {"solver.fem.tip_size", "solver.fem.growth"},
                    TIP_PRESSED: {"solver.fem.tip_size", "solver.fem.growth"},
                    SHAFT_MESH: {"solver.fem.section_size", "solver.fem.axial_size"},
                    PENALTY: {"solver.fem.surface_factor"},
                    "step": {"solver.fem.step_factor"},
                }[refinement.name]
            )
    tips = [one for one in refinements(1.0, 5e-4, False) if one.name in (TIP_MESH, TIP_PRESSED)]
    for full in tips:
        assert len(full.levels) >= 4
        assert min(full.levels) <= 0.1 + 1e-12  # mm: a fifth of the patch's radius


def test_preset_is_known_by_its_distance_and_every_refinement_but_the_penaltys() -> None:
    def found(limit: float, uncertainty: float) -> Convergence:
        return Convergence(True, 2.0, limit, uncertainty, limit, uncertainty)

    peak, impulse, duration = OF_A_TAP
    verdicts = {
        (TIP_MESH, peak): found(100.0, 0.004),
        (SHAFT_MESH, peak): found(100.0, 0.002),
        ("step", peak): found(100.0, 0.001),
        (PENALTY, peak): found(100.0, 0.5),
        ("step", impulse): found(100.0, 0.5),
    }
    preset = {peak.key: 99.5, impulse.key: 1.0, duration.key: None}
    (row,) = preset_rows(preset, verdicts, [TIP_MESH, SHAFT_MESH, "step", PENALTY])
    assert row["from_limit_percent"] == pytest.approx(-0.5)
    assert row["uncertainty_percent"] == pytest.approx(0.5 + 0.4 + 0.2 + 0.1)
    # a refinement whose levels failed has no share, so nothing is known
    assert preset_rows(preset, verdicts, [TIP_MESH, SHAFT_MESH, "step", "growth"]) == []


def test_a_mesh_file_is_refused_by_its_own_key(tmp_path: Path, fingertap: Run) -> None:
    said = fingertap("converge", "soft", "--set", "solver.fem.mesh=a.vtu", "--out", tmp_path)
    assert "solver.fem.mesh = 'a.vtu': a mesh from a file cannot be refined" in said.refusal


def test_a_key_that_the_study_varies_is_refused(tmp_path: Path, fingertap: Run) -> None:
    """It was overridden without a word."""
    given = ("--quick", "--set", "solver.fem.contact=penalty")
    said = fingertap("converge", "soft", *given, "--out", tmp_path)
    assert "--set solver.fem.contact: a convergence study sets it itself" in said.refusal


@pytest.mark.parametrize("given", ["solver.accuracy=1e-2", "solver={accuracy=1e-2}"])
def test_an_accuracy_of_all_models_is_kept_by_no_level(given: str) -> None:
    with pytest.raises(UserError, match=r"--set solver\.accuracy: "):
        check_given([given], refinements(1.0, 1e-3, quick=True))


def test_a_key_that_some_refinements_vary_is_kept_by_the_others() -> None:
    wanted = refinements(1.0, 1e-3, quick=True)
    check_given(["solver.fem.step_factor=0.5", "solver.fem.threads=1"], wanted)
    for key, value in (("tip_size", "1e-3"), ("preset", "fast"), ("accuracy", "1e-2")):
        with pytest.raises(UserError, match=rf"--set solver\.fem\.{key}: "):
            check_given([f" solver.fem.{key} = {value}"], wanted)
        with pytest.raises(UserError, match=rf"--set solver\.fem\.{key}: "):
            check_given([f'solver.fem = {{{key} = "{value}"}}'], wanted)


@pytest.mark.parametrize("stated", ["solver.accuracy=1e-2", "solver.fem.preset=converged"])
def test_what_a_scene_asks_of_its_mesh_does_not_mix_into_a_level(stated: str) -> None:
    """Halvings and damping of an accuracy, or of a preset, came with them."""
    level = next(iter(refinements(1.0, 5e-4, True)[0].levels.values()))
    texts = [f"{key}={value!r}" for key, value in level.items()]
    own, its = (load_scene("soft", (*given, *texts)).tables for given in ((), (stated,)))
    assert sizing_of(its, 3) == sizing_of(own, 3)
    assert solid_inputs.solid_parts(its) == solid_inputs.solid_parts(own)


def test_unknown_model_is_refused(tmp_path: Path, fingertap: Run) -> None:
    assert "fem3d" in fingertap("converge", "soft", "--model", "hcm", "--out", tmp_path).refusal


def test_a_peak_that_is_a_spike_has_no_limit(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Halving the step doubles it: of nodes that the impulse law stops in a run's first step."""
    numbers, elements = dict.fromkeys(KEPT, 1.0), itertools.count()

    def solved(*_: Any, **__: Any) -> Any:
        summary = SimpleNamespace(**numbers | {"elements": next(elements)})
        cautions = (f"{SPIKED}: use another law", "it is wet")
        return SimpleNamespace(
            status=reference_fem.Status.COMPLETED, summary=summary, cautions=cautions
        )

    monkeypatch.setattr(reference_fem, "simulate", solved)
    ended = fingertap("converge", "soft", "--model", "fem2d", "--quick", "--out", tmp_path)
    assert ended.code == 0
    assert "the peak force of 3 of 3 levels is a spike" in ended.err
    assert f"finest: {SPIKED}: use another law; it is wet" in ended.err
    table = pd.read_csv(tmp_path / "converge" / "soft-fem2d-quick" / "convergence.csv")
    assert set(table["quantity"]) == {"normal_impulse_N_s", "contact_duration_s"}
    given = ("--model", "fem2d", "--quick", "--out", tmp_path, "--json")
    printed = json.loads(fingertap("converge", "soft", *given).out)
    assert [row["quantity"] for row in printed["convergence"]] == table["quantity"].to_list()
    assert [row["peak_normal_force_N"] for row in printed["levels"]] == [None] * 15


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("patch", [5e-4, 2e-3, 3e-3, 7e-3])
def test_no_two_levels_have_one_mesh(patch: float, quick: bool) -> None:
    """On patches from a quarter of R on the tip's edges were longer than the section's, and both
    levels had the section's alone.
    """
    for refinement in refinements(1.0, patch, quick):
        counts = []
        for keys in refinement.levels.values():
            assert keys["solver.fem.tip_size"] < keys["solver.fem.section_size"]
            sizing, _ = sizing_of(
                load_scene("soft", [f"{k}={v!r}" for k, v in keys.items()]).tables, 3
            )
            counts.append(meshes.count_elements(FINGER, sizing, 3))
        rising = all(one < other for one, other in itertools.pairwise(counts))
        assert rising if refinement.of_mesh else len(set(counts)) == 1


def test_levels_that_fail_leave_no_tables(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They were empty, and the reason stood fifteen times in one line."""
    result = SimpleNamespace(status=reference_fem.Status.UNSTABLE, message="it burst")
    monkeypatch.setattr(reference_fem, "simulate", lambda *_, **__: result)
    ended = fingertap("converge", "soft", "--model", "fem2d", "--quick", "--out", tmp_path)
    assert "15 of 15 levels failed; the first: mesh: tip: edge at the contact, mm" in ended.err
    assert ended.err.count("scene soft: it burst") == 1
    assert not [*(tmp_path / "converge" / "soft-fem2d-quick").glob("*.*")]


def test_an_interrupted_study_says_how_far_it_got(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    levels = iter(range(4))

    def simulate(*_: object, **__: object) -> object:
        if next(levels) == 3:
            raise KeyboardInterrupt
        summary = SimpleNamespace(**dict.fromkeys(KEPT, 1.0))
        return SimpleNamespace(status=reference_fem.Status.COMPLETED, summary=summary, cautions=())

    monkeypatch.setattr(command, "warm_up", lambda _: None)
    monkeypatch.setattr(reference_fem, "simulate", simulate)
    ended = fingertap("converge", "soft", "--model", "fem2d", "--quick", "--out", tmp_path)
    assert "stopped at level 4 of 15: the same command goes on there" in ended.err


def test_a_mesh_that_is_the_level_befores_is_no_level(
    tmp_path: Path, fingertap: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    summary = SimpleNamespace(**dict.fromkeys(KEPT, 1.0))
    result = SimpleNamespace(status=reference_fem.Status.COMPLETED, summary=summary, cautions=())
    monkeypatch.setattr(reference_fem, "simulate", lambda *_, **__: result)
    ended = fingertap("converge", "soft", "--model", "fem2d", "--quick", "--out", tmp_path)
    assert "6 of 15 levels failed" in ended.err
    assert "its mesh is that of the level before" in ended.err
    table = pd.read_csv(tmp_path / "converge" / "soft-fem2d-quick" / "convergence.csv")
    assert set(table["refinement"]) == {PENALTY, "step"}


@pytest.mark.parametrize("given", ["surface_factor=300", "contact_damping=0"])
def test_a_number_of_a_contact_law_is_refused(given: str) -> None:
    """A scene that states its law too was told to set that law."""
    texts = ["solver.fem.contact='surface'", f"solver.fem.{given}"]
    said = given.replace("=", " = ") + ": a convergence study sets contact laws and their numbers"
    with pytest.raises(UserError, match=said):
        LevelRuns("soft", texts, "fem2d", asking({})[0])


@pytest.mark.parametrize("given", ["material.law=neo-hooke", "solver.fem.element=hex8-one-point"])
def test_what_plane_elements_lack_is_refused(given: str, tmp_path: Path) -> None:
    """It ended in a traceback: the model is built as the tap begins."""
    runs = LevelRuns("soft", [given], "fem2d", Store(tmp_path / "store"))
    with pytest.raises(UserError, match=r"scene soft: .*quad4-plane-stress"):
        runs.run({"solver.fem.preset": "fast", "solver.fem.contact": "impulse"})


@pytest.mark.slow
def test_plane_study_is_written_and_resumed(tmp_path: Path) -> None:
    run_converge("soft", model="fem2d", quick=True, out=tmp_path)
    folder = tmp_path / "converge" / "soft-fem2d-quick"
    for name in ("levels.csv", "convergence.csv", "convergence.md", "convergence.png"):
        assert (folder / name).stat().st_size > 100
    kept = sorted((tmp_path / "store").iterdir())
    assert len(kept) > 5
    times = [path.stat().st_mtime_ns for path in kept]
    value = json.loads((kept[0] / VALUES).read_text())[OF_A_TAP[0].key]
    assert math.isfinite(value)
    run_converge("soft", model="fem2d", quick=True, out=tmp_path)
    assert [path.stat().st_mtime_ns for path in kept] == times


def test_a_level_read_back_has_the_numbers_that_it_had(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its counts became 29632.0 and the like, so that a repeated study printed another table."""
    summary = dict.fromkeys(KEPT, 0.5) | {"elements": 29632, "steps": 1278}
    result = SimpleNamespace(
        status=reference_fem.Status.COMPLETED, summary=SimpleNamespace(**summary), cautions=()
    )
    monkeypatch.setattr(reference_fem, "simulate", lambda *_, **__: result)
    runs = LevelRuns("soft", [], "fem2d", Store(tmp_path / "store"))
    first, again = (runs.run({"solver.fem.contact": "impulse"}) for _ in range(2))
    assert json.dumps(again) == json.dumps(first)


def test_a_verdicts_row_is_in_percent_of_its_number() -> None:
    """17, 5, 2 = 1 + h^2: limit 1, GCI 1.25 (5 - 2)/(2 (2^2 - 1)), spread (17 - 2)/2."""
    found = convergence((4.0, 2.0, 1.0), (17.0, 5.0, 2.0), 2.0)
    (row,) = verdict_rows({(TIP_MESH, OF_A_TAP[0]): found})
    shown = [row[f"{name}_percent"] for name in ("uncertainty", "spread", "from_limit")]
    assert shown == pytest.approx([62.5, 750.0, 100.0])


def test_a_levels_result_belongs_to_the_impact_state_it_starts_from() -> None:
    """A key that a level sets itself changes the state alone, and gave the other scene's result."""
    answers, asked = asking({})
    for size in (5e-4, 1e-3):
        runs = LevelRuns("soft", [f"solver.fem.tip_size={size}"], "fem3d", answers)
        runs.run({"solver.fem.tip_size": 8e-4})
    assert asked[0] != asked[1]


@pytest.mark.usefixtures("figures_kept")
def test_changes_are_drawn_from_the_finest_level_in_percent(tmp_path: Path) -> None:
    """Peaks of 17, 5 and 2 N on edges halved: 750, 150 and 0 %."""
    keys = [entry.key for entry in OF_A_TAP]
    levels = {size: dict.fromkeys(keys, n) for size, n in ((4.0, 17.0), (2.0, 5.0), (1.0, 2.0))}
    tip = refinements(1.0, 5e-4, quick=False)[0]
    draw(tmp_path / "c.png", [RefinedRuns(tip, levels)], "soft")
    axis = plt.gcf().axes[0]
    assert axis.get_xlabel() == "edge at the contact, mm"
    for line in axis.lines[: len(keys)]:
        assert line.get_xdata() == pytest.approx([4.0, 2.0, 1.0])
        assert line.get_ydata() == pytest.approx([750.0, 150.0, 0.0])


def test_errors_are_expected_to_fall_as_theory_has_it() -> None:
    """Linear elements and central differences: order 2. A penalty's, with 1/factor: 1."""
    found = refinements(1.0, 5e-4, quick=False)
    assert {of.name: of.order for of in found if of.name != PENALTY} == dict.fromkeys(
        (TIP_MESH, TIP_PRESSED, SHAFT_MESH, "step"), 2.0
    )
    (penalty,) = [of for of in found if of.name == PENALTY]
    assert penalty.order == 1.0


def test_the_finest_levels_doubt_is_quoted() -> None:
    tip = refinements(1.0, 5e-4, quick=False)[0]
    peaks = {entry.key: 1.0 for entry in OF_A_TAP} | dict.fromkeys(PEAKS, 1.0)
    levels = {size: {**peaks, CAUTIONS: said} for size, said in ((4.0, "a"), (2.0, "b"), (1.0, ""))}
    assert cautions([RefinedRuns(tip, levels)], None) == []
    levels[1.0] = {**peaks, CAUTIONS: "c"}
    assert cautions([RefinedRuns(tip, levels)], None) == [f"{TIP_MESH}, finest: c"]


@pytest.mark.parametrize("patch", [5e-4, 5e-3], ids=["patch", "section"])
@pytest.mark.parametrize("scale", [1.0, 0.4])
def test_sizes_are_millimetres_and_the_inverse_of_a_penalty(scale: float, patch: float) -> None:
    """An error goes as 1/factor; half the edge has the root of the growth: log(g)/h is constant.

    A finger of another diameter has its edges in proportion, whether its patch or its section
    bounds them.
    """
    for whole, refinement in zip(
        refinements(1.0, patch, quick=False),
        refinements(scale, scale * patch, quick=False),
        strict=True,
    ):
        for of_whole, of_scaled in zip(
            whole.levels.values(), refinement.levels.values(), strict=True
        ):
            for key in ("section_size", "axial_size", "tip_size", "patch_size"):
                size = of_whole[f"solver.fem.{key}"]
                assert of_scaled[f"solver.fem.{key}"] == pytest.approx(scale * float(size))
        for size, keys in refinement.levels.items():
            if refinement.name == PENALTY:
                assert size == pytest.approx(1.0 / keys["solver.fem.surface_factor"])
            if refinement.name in (TIP_MESH, TIP_PRESSED):
                edge, growth = (keys[f"solver.fem.{key}"] for key in ("tip_size", "growth"))
                assert size == pytest.approx(1e3 * edge)
                if patch == 5e-4:
                    assert math.log(growth) / edge == pytest.approx(math.log(1.15) / 1e-4 / scale)
            if refinement.name == SHAFT_MESH:
                assert size == pytest.approx(1e3 * keys["solver.fem.section_size"])


def test_what_is_printed_is_in_the_unit_of_its_number(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """100 + (edge/0.1 mm)^2 N: GCI 1.25 N at 101 N. The preset's 102 N: its 2 %, and twice GCI."""

    elements = itertools.count()

    class Levels:
        scene, patch = load_scene("soft"), 5e-4

        def run(self, level: LevelKeys) -> dict[str, float | str]:
            peak = 102.0
            if "solver.fem.tip_size" in level:
                peak = 100.0 + (float(level["solver.fem.tip_size"]) / 1e-4) ** 2
            another = {"elements": next(elements), "time_step_s": 1e-7, CAUTIONS: ""}
            return dict.fromkeys((entry.key for entry in OF_A_TAP), peak) | another

    monkeypatch.setattr(command, "LevelRuns", lambda *_: Levels())
    monkeypatch.setattr(command, "draw", lambda *_: None)
    run_converge("soft", out=tmp_path)
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    peaks = [line.partition("peak Fn ")[2] for line in lines if "peak Fn" in line]
    assert peaks[0].startswith("finest 101.0 +- 1.3 N limit 100.0 ")
    # the same numbers in N s and s: value and error are in the unit that is shown
    assert any("normal impulse finest 101000 +- 1300 mN s" in line for line in lines)
    assert any("contact duration finest 1.010e+08 +- 1.3e+06 us" in line for line in lines)
    percent = 2.0 + 2 * 100 * 1.25 / 101
    assert 4.0 < 1.02 * percent < 5.0  # N
    assert peaks[-1] == f"102 +- 5 N +2.00 % from the tip's limit, known to {percent:.1f} % in all"
