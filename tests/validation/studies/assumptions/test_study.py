"""The study of the reduced model's assumptions: its scenes, its stored dataset, its rules."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray
from matplotlib import pyplot as plt

from hcm.assumptions import Assumptions
from tests.validation.commands import Make, Patch, Run
from validation.compare.differences import differences_of
from validation.harness.quantities import TAP_AND_STRESS
from validation.harness.record import RunRecord
from validation.harness.store import Store
from validation.harness.timing import Timed
from validation.models import solid_mesh
from validation.models.variants import all_variants, cumulative, leave_one_out
from validation.runs.execute import Job
from validation.scenes.load import load_scene
from validation.studies.assumptions import study, study_command, waterfall_command
from validation.studies.assumptions.rule import WRONG, Rule, fitted, rules
from validation.studies.assumptions.study import BARS, STATUS, known, points, read_study
from validation.studies.assumptions.study_command import numbers_of, shares_of
from validation.sweep.plan import assignment

FIRST = points(2)


@pytest.mark.usefixtures("figures_kept")
def test_the_studys_figure_shows_medians_and_the_refined_models_errors(tmp_path: Path) -> None:
    stored = read_study()
    table = stored[known(stored)].iloc[:5]
    refined = len(cumulative()) - 1
    errors = np.random.default_rng(3).uniform(
        -6.0, 6.0, (len(all_variants()), 5, len(TAP_AND_STRESS))
    )
    errors[refined, 1, 0], errors[0, 2, 0] = 30.0, np.nan
    study_command._draw(tmp_path / "study.png", table, errors, all_variants())
    axes = plt.gcf().axes
    labels = [text.get_text() for text in axes[0].get_yticklabels()]
    assert labels[refined + 3 : refined + 6 : 2] == [
        "without lowest point and 4 that need it", "without partial slip"
    ]  # fmt: skip
    for n, (above, below) in enumerate(zip(axes[:4], axes[4:8], strict=True)):
        size = np.abs(errors[:, :, n])
        widths = [bar.get_width() for bar in above.patches]
        np.testing.assert_allclose(widths, np.nanmedian(size, axis=1))
        marks = above.lines[0].get_xdata()
        np.testing.assert_allclose(marks, np.nanpercentile(size, 90, axis=1))
        shown = below.collections[-1].get_offsets()
        np.testing.assert_allclose(shown[:, 0], table["patch_over_radius"])
        np.testing.assert_allclose(shown[:, 1], np.clip(errors[refined, :, n], -8.0, 8.0))
        assert below.get_xlabel() == "predicted a/R" + "\n(1 beyond the edge)" * (n == 0)


def _unless(
    failed: str | None, make: Make, says: Mapping[str | None, str]
) -> Callable[..., list[RunRecord]]:
    """The waterfall's runs, of which the one of the variant `failed` does not complete."""

    def run(jobs: Sequence[Job], folder: Path, store: Store) -> list[RunRecord]:
        if jobs[0].model == "fem3d":  # as `run` and `validate` solve it
            assert jobs[0].overrides[0] == "solver.fem.accuracy=0.01"
        return [
            make(
                *(job.scene, job.model, job.variant or ""),
                message=says.get(job.variant, ""),
                status="UNBALANCED" if job.variant == failed else "COMPLETED",
                ok=job.variant != failed,
            )
            for job in jobs
        ]

    return run


def test_the_waterfall_says_what_its_runs_say_of_themselves(
    make_record: Make, tmp_path: Path, monkeypatch: Patch, fingertap: Run
) -> None:
    says = {None: "it is wet", "+ hertz": "it is wet", "+ shear": "it is dry"}
    run = _unless("+ shear", make_record, says)
    monkeypatch.setattr(waterfall_command, "in_fresh_process", run)
    given = ("--set", "material.youngs_modulus=5e8", "--set", "solver.hcm.hertz=true")
    ended = fingertap("waterfall", "soft", *given, "--out", tmp_path)
    assert ended.code == 1
    ignored = "solver.hcm: hertz ignored: this command sets each switch in turn"
    assert ended.err.splitlines() == [
        "fingertap: caution: soft, fem3d and 1 more: it is wet",
        "fingertap: caution: soft, hcm + shear: UNBALANCED: it is dry",
        f"fingertap: caution: soft, {ignored}",
        "fingertap: error: scene soft: 1 of 23 reduced runs failed: + shear",
    ]
    folder = tmp_path / "waterfall" / "soft"
    caption, *table = (folder / "waterfall.md").read_text(encoding="utf-8").splitlines()
    assert caption == (
        "soft with material.youngs_modulus=5e8, solver.hcm.hertz=true: the reduced model against"
        " fem3d, assumption by assumption. Caution: fem3d and 1 more: it is wet."
        f" Caution: {ignored}"
    )
    latex = (folder / "waterfall.tex").read_text(encoding="utf-8")
    assert caption.replace("_", "\\_") in latex
    (row,) = (" ".join(line.split()) for line in table if "+ shear" in line)
    assert row == "| + shear | - | - | - | - | UNBALANCED |"
    failed = pd.read_csv(folder / "waterfall.csv", index_col=0)["failed"].dropna()
    assert failed.to_dict() == {"+ shear": "UNBALANCED: it is dry"}
    as_json = fingertap("waterfall", "soft", *given, "--out", tmp_path, "--json")
    assert (as_json.code, as_json.err) == (ended.code, ended.err)
    rows = {row["assumptions"]: row for row in json.loads(as_json.out)["assumptions"]}
    assert len(rows) == 23
    assert rows["+ shear"]["peak_normal_force_N_error_percent"] is None
    assert rows["+ hertz"]["failed"] is None


def test_a_waterfall_without_a_reference_leaves_no_older_tables(
    make_record: Make, tmp_path: Path, monkeypatch: Patch, fingertap: Run
) -> None:
    for failed, files in (("none of them", 5), (None, 0)):
        run = _unless(failed, make_record, {})
        monkeypatch.setattr(waterfall_command, "in_fresh_process", run)
        assert fingertap("waterfall", "soft", "--out", tmp_path).code == (files == 0)
        assert len(list(tmp_path.glob("waterfall/soft/waterfall.*"))) == files


@pytest.mark.usefixtures("figures_kept")
def test_the_waterfall_shows_each_assumptions_error(make_record: Make, tmp_path: Path) -> None:
    reference = replace(make_record(peak=80.0), errors={"peak_normal_force_N": 1.6})
    runs = [make_record("soft", "hcm", v.name, 60.0 + n) for n, v in enumerate(all_variants())]
    runs[-1] = replace(runs[-1], ok=False)
    rows = [
        differences_of("soft", "", run if run.ok else None, reference, TAP_AND_STRESS)
        for run in runs
    ]
    waterfall_command._write(tmp_path, "soft: a title", [], rows, runs)
    figure = plt.gcf()
    first = figure.axes[0]
    *bars, known_to = first.patches
    wanted = [*(100.0 * ((60.0 + np.arange(len(rows) - 1)) / 80.0 - 1.0)), np.nan]
    np.testing.assert_allclose([bar.get_width() for bar in bars], wanted)
    assert (known_to.get_x(), known_to.get_width()) == pytest.approx((-2.0, 4.0))
    assert [(text.get_text(), text.xy) for text in first.texts] == [("failed", (0, -len(runs)))]
    assert first.get_ylim() == pytest.approx((-len(runs) - 0.6, 0.6))
    assert "without hertz and 5 that need it" in [t.get_text() for t in first.get_yticklabels()]
    assert figure.get_suptitle() == "soft: a title"
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["the reference's own error"]
    figure.draw_without_rendering()
    assert all(a.title.get_window_extent().x1 < figure.bbox.x1 for a in figure.axes)
    assert first.bbox.x0 < 0.3 * figure.bbox.x1
    table = pd.read_csv(tmp_path / "waterfall.csv")
    np.testing.assert_allclose(table["peak_normal_force_N_error_percent"], wanted)
    np.testing.assert_allclose(table["peak_normal_force_N_reference_error_percent"], 2.0)
    lines = (tmp_path / "waterfall.md").read_text(encoding="utf-8").splitlines()
    cells = [line.split("|")[2].strip() for line in lines[4:]]
    assert [*cells[:3], *cells[-2:]] == ["-25.0", "-23.8", "-22.5", "-", "+-2"]


@pytest.mark.parametrize("point", FIRST, ids=lambda p: f"{p['finger.phalanges']} phalanges")
def test_a_point_touches_with_the_wanted_angle(point: dict[str, Any]) -> None:
    """By the reference's own rigid chain, that of the true body."""
    keys = [assignment(key, value) for key, value in point.items() if "." in key]
    touch = solid_mesh.predicted_touch(load_scene("soft", keys).tables, 3)
    # a hundredth of R above the surface: 0.18 degrees seen
    assert math.degrees(touch.angle) == pytest.approx(90.0 - point["angle_deg"], abs=0.3)
    # the spring holds Hertz's energy, 2/5 F d, at Hertz's depth d = a^2/R
    depth = point["patch_over_radius"] ** 2 * 0.0075
    energy = 0.5 * point["tip.normal_stiffness"] * depth**2
    assert energy == pytest.approx(0.5 * touch.mass * touch.speed**2, rel=1e-4)


def test_the_stored_scenes_are_the_sequences_and_keep_their_bars() -> None:
    stored = read_study()
    for point, (_, row) in zip(FIRST, stored.iterrows(), strict=False):
        for key, value in point.items():
            assert row[key] == pytest.approx(value, rel=1e-12)
    assert len(stored) == 128
    completed = stored[stored[STATUS] == "COMPLETED"]
    assert len(completed) >= 120
    for entry in TAP_AND_STRESS:
        assert (completed[entry.key] > 0).all()
        assert (completed[f"{entry.key}_error"] > 0).all()
    assert known(stored).all()
    for key, bar in BARS.items():
        assert (stored[f"{key}_error"] <= bar * stored[key]).all()


def test_shares_count_what_did_not_complete_as_outside() -> None:
    errors = np.zeros((1, 4, len(TAP_AND_STRESS)))
    errors[0, 1, 0] = -1.9  # inside 2 %
    errors[0, 2, 3] = 4.9  # a stress inside 5 %
    errors[0, 3] = np.nan
    bars = np.zeros((4, len(TAP_AND_STRESS)))
    (row,) = shares_of(errors, ["paper"], bars).to_dict("records")
    assert row["all four"] == row["all within 5 %"] == 75.0
    errors[0, 1, 0] = -2.1
    (row,) = shares_of(errors, ["paper"], bars).to_dict("records")
    assert (row["all four"], row["all within 5 %"]) == (50.0, 75.0)
    assert row["within these and the bars"] == 50.0
    bars[1, 0] = 0.2  # the reference's own error
    (row,) = shares_of(errors, ["paper"], bars).to_dict("records")
    assert (row["all four"], row["within these and the bars"]) == (50.0, 75.0)


def test_fingers_too_flexible_for_a_rigid_flight_count_and_failures_do_not() -> None:
    """As the reference, the study's runs fly rigid: what that leaves out is told apart."""
    status = np.array([["COMPLETED", "TOO_FLEXIBLE"], ["NEWTON_FAILED", "COMPLETED"]])
    data = {
        entry.key: (("scene", "model"), np.array([[1.0, 2.0], [3.0, 4.0]]))
        for entry in TAP_AND_STRESS
    }
    runs = xarray.Dataset({"status": (("scene", "model"), status), **data})
    np.testing.assert_array_equal(numbers_of(runs)[..., 0], [[1.0, np.nan], [2.0, 4.0]])


def test_every_variant_flies_as_the_reference_and_the_last_one_not(
    monkeypatch: Patch, tmp_path: Path
) -> None:
    asked: list[dict[str, Any]] = []
    until: list[list[float] | None] = []

    def swept(table: pd.DataFrame, name: str, models: list[dict[str, Any]], *rest: object) -> Any:
        asked.extend(models)
        until.append(table[study.UNTIL].tolist() if study.UNTIL in table else None)
        return xarray.Dataset({"n": ("model", np.ones(len(models)))})

    monkeypatch.setattr(study, "_swept", swept)
    scenes = pd.DataFrame({"contact_duration_s": [2e-4, math.nan]})
    found = study.by_variants(scenes, (*cumulative(), *leave_one_out()), 1, tmp_path)
    assert found.sizes["model"] == len(asked)
    flights = [model["set"].pop("solver.hcm.flight") for model in asked]
    assert flights == ["rigid"] * (len(asked) - 2) + ["elastic", "rigid"]
    refined = asked[len(cumulative()) - 1]
    assert asked[-1]["set"] == asked[-2]["set"] == refined["set"]
    names = [asked[-2]["variant"], asked[-1]["variant"]]
    assert names == [study.ELASTIC, study.OWN]
    assert until == [[2e-4, 0.0], None]  # the last one ends its tap by its own rule


def test_a_rule_is_rarely_wrong_where_it_was_fitted_and_finds_the_quantity() -> None:
    rng = np.random.default_rng(1)
    seen = pd.DataFrame({"x": rng.random(200), "mu": rng.random(200)})
    moved = 10.0 * (1.0 - seen["mu"].to_numpy())
    rule = fitted(seen, moved, 2.0)
    assert (rule.name, rule.sign) == ("mu", -1.0)
    assert -rule.limit == pytest.approx(0.8, abs=0.01)  # ends on one that it is right of
    assert str(rule) == f"mu >= {-rule.limit:.3g}"
    strewn = moved.copy()
    strewn[seen["mu"].argmax()] = 9.0  # one that nothing known tells
    rule = fitted(seen, strewn, 2.0)
    wrong = strewn[rule.holds(seen)] > 2.0
    assert (rule.name, rule.sign) == ("mu", -1.0)
    assert 0 < wrong.mean() <= WRONG
    rank = seen["mu"].rank().to_numpy()
    often = np.where(rank % 8 == 0, 9.0, 0.0)  # one of eight: no long stretch is right enough
    rule = fitted(seen[["mu"]], often, 2.0)
    assert (often[rule.holds(seen)] > 2.0).mean() <= WRONG
    assert str(fitted(seen, np.full(200, np.nan), 2.0)) == "never"
    assert not Rule().holds(seen).any()


def test_halves_judge_each_other() -> None:
    """Where what moves has nothing to do with what is known, a rule is wrong on the other half."""
    table = pd.DataFrame(points(2) * 32)
    table["surface.friction"] = np.linspace(0.0, 1.0, len(table))
    named = [variant.name for variant in leave_one_out()][:2]
    moved = np.array([10.0 * table["surface.friction"], np.where(np.arange(64) < 32, 0.0, 9.0)])
    found = rules(table, moved, named, {"soft": np.array([0.5, 1.0])}).set_index(
        ["without", "error allowed (%)"]
    )
    by_friction, by_chance = (found.loc[(name, 5.0)] for name in named)
    assert by_friction["rule"].startswith("mu <= 0.492")  # 31 of 63
    assert by_friction["of these wrongly (%)"] is not None
    assert by_chance["of these wrongly (%)"] == 100.0  # all of the half that does not move


def test_times_are_over_the_refined_models(monkeypatch: Patch) -> None:
    """Taken in turns; those of the sweep were off by up to 1.9 times, with the machine's load."""
    asked = []

    def timed(runs: Any, budget_s: float) -> list[Timed[None]]:
        asked.extend(run.args[1].assumptions for run in runs)
        return [Timed(None, 2.0 if one == asked[0] else 1.0, 3) for one in asked]

    monkeypatch.setattr(study_command, "shortest_in_turns", timed)
    np.testing.assert_array_equal(study_command._cost("soft"), [0.5] * len(leave_one_out()))
    assert all(asked[0].has(field.name) for field in fields(Assumptions)[1:-1])


@pytest.fixture
def references(monkeypatch: Patch) -> list[tuple[int, float]]:
    """In the place of sweeps: numbers of 1, known to accuracy times mu, to half of that where the
    tip's edges are stated, and to a quarter of it where its touches are; a run does not complete
    where mu > 90, nor where mu is large and the accuracy or the tip fine. What was asked for."""
    asked = []

    def swept(table: pd.DataFrame, *rest: object) -> xarray.Dataset:
        asked.append((len(table), float(table[study.ACCURACY].iloc[0])))
        mu, accuracy = (
            table[key].to_numpy()[:, None] for key in ("surface.friction", study.ACCURACY)
        )
        finer, ones = study.TIP in table, np.ones_like(mu)
        held = finer and (table[study.HELD] == 1.0).all()
        errors = accuracy * mu * (0.5 if finer else 1.0) * (0.25 if held else 1.0)
        ended = (mu < 90.0) & ((mu < 2.0) | (accuracy > 2e-3)) & ((mu < 3.0) | held | (not finer))
        data = {"status": (("scene", "model"), np.where(ended, "COMPLETED", "INVERTED_ELEMENT"))}
        for entry in TAP_AND_STRESS:
            data[entry.key] = (("scene", "model"), ones)
            data[f"{entry.key}_error"] = (("scene", "model"), errors)
        return xarray.Dataset(data)

    monkeypatch.setattr(study, "_swept", swept)
    return asked


def test_scenes_are_solved_as_finely_as_they_complete(
    references: list[tuple[int, float]], tmp_path: Path
) -> None:
    """The impulse's bar is 0.5 %: kept to mu = 2.5 at 2e-3, to 1.6 at 3e-3, to twice that with
    finer edges, but for one that does not complete with them and keeps it over its own touches."""
    given = [{**FIRST[0], "surface.friction": mu} for mu in (0.9, 1.6, 2.4, 3.1, 95.0)]
    table = study.solved(given, 1, tmp_path)
    assert references == [(5, 2e-3), (3, 3e-3), (1, 5e-3), (2, 3e-3), (1, 3e-3)]
    assert table[study.ACCURACY].tolist() == [2e-3, 2e-3, 3e-3, 3e-3, 5e-3]
    assert table[study.STATUS].eq("COMPLETED").tolist() == [True, True, True, True, False]
    assert known(table).tolist() == [True, True, True, True, False]
    assert table[study.HELD].tolist() == [0.0, 0.0, 0.0, 1.0, 0.0]
    own = [study._tip_size(row) for row in table.drop(columns=study.TIP).to_dict("records")]
    assert (table[study.TIP] / own).tolist() == pytest.approx([1.0, 1.0, 0.7, 1.0, 1.0])


def test_stored_numbers_that_are_not_found_again_fail(
    references: list[tuple[int, float]], fingertap: Run, tmp_path: Path
) -> None:
    ended = fingertap("study", "--again", 5, "--out", tmp_path)
    assert [asked[0] for asked in references] == [5]
    assert ended.code == 1
    assert ended.out.count("of the stored errors") == 5
    assert "moved by more than the stored errors" in ended.err


@pytest.mark.parametrize("times", [1.0, 10.0])
def test_stored_errors_that_are_not_found_again_fail(
    times: float, monkeypatch: Patch, fingertap: Run, tmp_path: Path
) -> None:
    """References stated ten times their stored errors, of which nothing was said."""
    stored = read_study()

    def swept(table: pd.DataFrame, *_rest: object) -> xarray.Dataset:
        own = stored.loc[table.index]
        data: dict[str, Any] = {"status": (("scene", "model"), own[[study.STATUS]].to_numpy())}
        for key in study.KEYS:
            data[key] = (("scene", "model"), own[[key]].to_numpy())
            data[f"{key}_error"] = (("scene", "model"), times * own[[f"{key}_error"]].to_numpy())
        return xarray.Dataset(data)

    monkeypatch.setattr(study, "_swept", swept)
    ended = fingertap("study", "--again", 5, "--out", tmp_path)
    assert ended.code == int(times > 1.0)
    assert ended.out.count(f"its errors are up to {times:g} times the stored ones") == 5
    assert ("no longer within 1, 0.5, 2, 5 %" in ended.err) == (times > 1.0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--again", -1), "--again -1: must be 0 to 128"),
        (("--again", 129), "--again 129: must be 0 to 128"),
        (("--again", 1, "--solve", 1), "--again 1: --solve takes scenes of its own"),
        (("--solve", -3), "--solve -3: must be 0 or more"),
        (("--seed", -1, "--again", 1), "--seed -1: must be 0 to 4294967295"),
        (("--workers", 0), "--workers 0: must be 1 or more"),
    ],
)
def test_numbers_that_no_study_has_are_refused(
    given: tuple[object, ...], said: str, fingertap: Run, tmp_path: Path
) -> None:
    ended = fingertap("study", *given, "--out", tmp_path)
    assert (ended.code, said in ended.err) == (2, True)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_stored_references_are_found_again(fingertap: Run, tmp_path: Path) -> None:
    ended = fingertap("study", "--again", 2, "--workers", 1, "--out", tmp_path)
    assert ended.code == 0
    assert ended.out.count("differs by") == 2


def test_a_rules_share_is_of_the_half_that_it_was_not_fitted_on() -> None:
    """Of friction up to 1 the first half has 0 to 0.5: the second's rule holds for all of it."""
    table = pd.DataFrame(points(2) * 32)
    table["surface.friction"] = np.linspace(0.0, 1.0, len(table))
    moved = np.array([np.where(table["surface.friction"] < 0.75, 0.0, 9.0)])
    (row, *_) = rules(table, moved, ["one"], {}).to_dict("records")
    # fitted on the first half: every x; on the second one: mu < 0.75, so all of the first
    assert row["of these wrongly (%)"] == pytest.approx(100.0 * 16 / 64, abs=2.0)


def test_an_elastic_flights_effect_is_over_the_refined_models(monkeypatch: Patch) -> None:
    """0.1 % on nine scenes, 30 % on one; the model's own tap, which is last, is another matter."""
    stored = read_study()
    scenes = stored[known(stored)].iloc[:10]
    numbers = np.ones((len(all_variants()) + 2, 10, len(TAP_AND_STRESS)))
    numbers[len(cumulative())], numbers[-1] = 5.0, 2.0
    numbers[-2], numbers[-2, 0] = 1.001, 0.7
    said = study_command._flight(numbers, scenes)
    # between the ninth and the tenth: 0.1 + 0.1 (30 - 0.1) %
    assert "peak Fn 0.1 % (3.1, 30)" in said
    assert "by less than the bars in 9 of" in said
    asked: list[Any] = []
    monkeypatch.setattr(study_command, "_cost", lambda finger: None)
    monkeypatch.setattr(study_command, "rules", lambda *given: asked.extend(given))
    whole, first = np.ones((len(all_variants()), 1, len(TAP_AND_STRESS))), len(cumulative())
    whole[first - 2] = 7.0
    whole[first, 0] = 1.02, 0.95, 1.0, 3.0  # a stress is no part of a rule
    study_command._rules(scenes[:1], whole)
    assert asked[1][:, 0] == pytest.approx([5.0] + [0.0] * (len(leave_one_out()) - 1))


def test_a_rules_row_counts_all_scenes_and_its_own_time() -> None:
    """Three quarters could do without; either half's rule holds for all of the other half."""
    table = pd.DataFrame(points(2) * 32)
    table["surface.friction"] = np.linspace(0.0, 1.0, len(table))
    moved = np.array([np.where(table["surface.friction"] < 0.75, 0.0, 9.0)] * 2)
    found = rules(table, moved, ["one", "two"], {"soft": np.array([0.5, 0.8])})
    assert (found["scenes that could (%)"] == 75.0).all()
    assert (found["the rule says so (%)"] == 100.0).all()
    times = found.groupby("without")["time, soft (%)"].unique()
    assert [time.tolist() for time in times] == [[50.0], [80.0]]


@pytest.mark.usefixtures("figures_kept")
def test_a_maps_bars_are_the_references_errors_in_percent() -> None:
    stress = TAP_AND_STRESS[-1]
    table = pd.DataFrame({"patch_over_radius": [0.1, 0.2], "surface.friction": [0.3, 1.0],
                          stress.key: [-2e6, 1e6], f"{stress.key}_error": [2e4, 3e4]})  # fmt: skip
    _, axis = plt.subplots()
    study_command._map(axis, table, np.array([1.0, -2.0]), stress)
    bars, shown = axis.collections
    ends = np.array(bars.get_segments())[:, :, 1]
    np.testing.assert_allclose(ends, [[0.0, 2.0], [-5.0, 1.0]])  # 1 and 3 %
    np.testing.assert_allclose(shown.get_array(), table["surface.friction"])


def test_errors_are_over_the_references_numbers_and_other_touches_are_counted(
    monkeypatch: Patch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """All runs are 25 % above; one scene's own tap lasts longer by 1 %, another's by 1e-4."""
    stored = read_study().iloc[:3]
    shape = len(stored), len(all_variants()) + 2
    data: dict[str, Any] = {"status": (("scene", "model"), np.full(shape, "COMPLETED"))}
    for key in study.KEYS:
        column = 1.25 * np.tile(stored[[key]].to_numpy(), shape[1])
        if key == "contact_duration_s":
            column[:, -1] *= 1.01, 1.0001, 1.0
        data[key] = (("scene", "model"), column)
    monkeypatch.setattr(study_command, "by_variants", lambda *_: xarray.Dataset(data))
    monkeypatch.setattr(study_command, "_rules", lambda *_: pd.DataFrame({"rule": ["never"]}))
    monkeypatch.setattr(study_command, "_draw", lambda *_: None)
    study_command._compare(stored, np.ones(3, dtype=bool), 1, tmp_path, tmp_path)
    found = pd.read_csv(tmp_path / "study.csv")
    np.testing.assert_allclose(found["peak Fn (%)"], 25.0)
    assert "in 1 scenes the refined model's own tap has other touches" in capsys.readouterr().out
