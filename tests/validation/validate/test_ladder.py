"""The ladder: the common impact state, its rows, rung 2 on both bodies, the identified contact."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import reference_fem
from tests.validation.commands import Make, Patch
from tests.validation.validate.test_page import cause_of
from validation.converge.verdicts import preset_uncertainties, study_of
from validation.errors import RunFailedError, UserError
from validation.harness.files import write_json
from validation.harness.record import RunRecord
from validation.harness.store import Store
from validation.identify.contact import MESHES, ContactIdentification, identify_contact
from validation.models.impact import impact_of
from validation.models.solid_mesh import sizes_of
from validation.scenes.load import NamedScene, load_scene
from validation.validate.ladder import ladder as ladder_module
from validation.validate.ladder import rungs
from validation.validate.ladder.ladder import (
    Ladder,
    cause_sentences,
    check_sentences,
    compute_ladder,
    explicit_flight,
    peak_sentences,
)
from validation.validate.ladder.rungs import (
    CONTACT,
    OWN,
    SAME,
    Comparison,
    compare_runs,
    mesh_keys,
    paper_rung,
    structure_rung,
    uncertainties,
)
from validation.validate.ladder.runs import (
    Contact,
    LadderRuns,
    full_contact,
    lumped_solid,
    reduced,
    scene_contact,
    touching_meshes,
)
from validation.validate.page import ladder_context, table_rows, write_tables
from validation.validate.patches import contact_patches
from validation.validate.plan import Runs, paper_jobs
from validation.validate.tables import (
    TABLE_2,
    TABLE_3,
    accuracy_against_cost,
    check_row,
    paper_rows,
    shaft_holes,
)


def test_impact_state_is_the_reduced_models_own() -> None:
    scene = load_scene("soft")
    impact = impact_of(scene)
    # The two solvers agree: t_c = 0.136107 s and the tip's velocity at contact.
    assert impact.time_s == pytest.approx(0.136107, abs=2e-6)
    tip = 0.04 * np.array(impact.rates)
    assert tip @ np.sin(impact.angles) == pytest.approx(1.8136, rel=1e-3)
    assert -tip @ np.cos(impact.angles) == pytest.approx(-1.6544, rel=1e-3)
    # The third phalanx points 38 degrees down: the ball's centre lies 7.5 mm sin 38 above its
    # end, its lowest point 7.5 mm below the centre.
    below = 0.0075 * (1 - np.sin(impact.angles[-1]))
    assert impact.sphere_height_m == pytest.approx(0.1 + below, abs=1e-5)
    assert np.degrees(impact.touch_angle) == pytest.approx(51.8, abs=0.1)
    contact = scene_contact(scene)
    falls, starts = reduced(scene, contact, None), reduced(scene, contact, impact)
    peaks = [run.value("peak_normal_force_N") for run in (falls, starts)]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-3)


@pytest.mark.parametrize(
    "drive",
    [
        ("drive.torques=[0.005, 0.0, 0.0]",),
        ("drive.torques=[0.01, 0.005, 0.0]", "drive.reaction=true", "surface.incline=0.35"),
        (
            "drive.torques={time=[0.01, 0.03, 0.03, 0.1], "
            "values=[[0, 0, 0], [0.01, 0, 0], [0, 0, 0.002], [0.005, 0.0, 0.0]]}",
        ),
    ],
    ids=["level", "reaction on an incline", "jump and ramp"],
)
def test_driven_rods_arrive_with_the_driven_beams(drive: tuple[str, ...]) -> None:
    scene = load_scene("soft", (*drive, "finger.elements=5"))
    arrival = reduced(scene, scene_contact(scene), None).value("contact_time_s")
    assert arrival < 0.13
    # Beams that a torque bends arrive as rigid rods to within their vibrations.
    assert impact_of(scene).time_s == pytest.approx(arrival, rel=2e-3)


def test_scenes_without_a_common_impact_are_refused() -> None:
    with pytest.raises(RunFailedError, match="does not reach"):
        impact_of(load_scene("soft", ("drive.gravity=-9.8",)))


def test_rows_compare_every_quantity_with_the_references_error_bar(make_record: Make) -> None:
    rows = compare_runs(
        3, make_record(peak=60.0), make_record(model="fem3d", peak=75.0),
        {"peak_normal_force_N": 0.02}, SAME,
    )  # fmt: skip
    by_name = {row.quantity: row for row in rows}
    peak = by_name["peak Fn (N), same impact"]
    assert (peak.reduced, peak.reference, peak.reference_uncertainty) == (60.0, 75.0, 1.5)
    assert peak.error_percent == pytest.approx(-20.0)
    assert not any("first contact" in name or "velocity" in name for name in by_name)
    # Curves that differ by a factor 0.8: M = -0.2, P = 0.
    assert by_name["Sprague-Geers M of Fn (%), same impact"].error_percent == pytest.approx(-20)
    rating = next(row for name, row in by_name.items() if name.startswith("ISO/TS 18571"))
    assert rating.reference == 1.0
    assert rating.error_percent == pytest.approx(100 * (rating.reduced - 1))
    own = {row.quantity for row in compare_runs(3, make_record(), make_record(), {}, OWN)}
    assert "time of first contact (ms), own flight" in own


def test_uncertainty_is_the_index_or_the_spread(make_record: Make) -> None:
    # 64 + h^2: order 2, limit 64, so GCI = 1.25 * 1/65 at h = 1.
    runs = [make_record(peak=64 + h * h) for h in (4.0, 2.0, 1.0)]
    shares = uncertainties([4.0, 2.0, 1.0], runs)
    assert shares["peak_normal_force_N"] == pytest.approx(1.25 / 65, rel=1e-6)
    zigzag = [make_record(peak=peak) for peak in (64.0, 66.0, 65.0)]
    assert uncertainties([4.0, 2.0, 1.0], zigzag)["peak_normal_force_N"] == pytest.approx(2 / 65)
    pair = uncertainties([2.0, 1.0], runs[1:])
    assert pair["peak_normal_force_N"] == pytest.approx(3 / 65)
    stated = replace(runs[-1], errors={"peak_normal_force_N": 1.0})
    for others, known in ((runs[:2], 1.25 / 65), ([stated], 1 / 65)):  # two may agree by chance
        found = uncertainties([4.0, 2.0, 1.0], [*others, stated])["peak_normal_force_N"]
        assert found == pytest.approx(known, rel=1e-6)


def test_study_of_convergence_is_read_where_it_is_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A table cut within a number was believed, and an empty one ended the process."""
    path, tables = tmp_path / "convergence.csv", load_scene("soft").tables
    assert preset_uncertainties(tmp_path, tables) == {}
    whole = (
        "refinement,quantity,uncertainty_percent\npreset,contact_duration_s,\n"
        "penalty,peak_normal_force_N,5\npreset,nonsense,0.3\npreset,peak_normal_force_N,1.5\n"
    )
    path.write_text(whole)
    made_from = study_of(tables, "fem3d", path)
    write_json(tmp_path / "scene.json", made_from)
    assert preset_uncertainties(tmp_path, tables) == {"peak_normal_force_N": pytest.approx(0.015)}
    smooth = load_scene("soft", ["surface.friction=0"]).tables
    assert preset_uncertainties(tmp_path, smooth) == {}  # the study was of another scene
    assert capsys.readouterr().err == ""
    for text in (whole[:-3], ""):
        path.write_text(text)
        assert preset_uncertainties(tmp_path, tables) == {}
        assert "the study is damaged" in capsys.readouterr().err
    path.write_text(whole)
    # what such a file held before it named its code, perhaps with other keys of a scene
    for older in ({**made_from, "source": "older"}, {"tables": {}, "mesh_sha256": None}):
        write_json(tmp_path / "scene.json", older)
        assert preset_uncertainties(tmp_path, tables) == {}
        assert "was made by other code" in capsys.readouterr().err
    path.write_text("\n")  # of a study without three levels of anything
    write_json(tmp_path / "scene.json", study_of(tables, "fem3d", path))
    assert preset_uncertainties(tmp_path, tables) == {}
    assert capsys.readouterr().err == ""
    for text in ("{", "[]"):
        (tmp_path / "scene.json").write_text(text)
        assert preset_uncertainties(tmp_path, tables) == {}
        assert "the study is damaged" in capsys.readouterr().err


def test_tables_page_and_sentences(make_record: Make, tmp_path: Path) -> None:
    rows = [
        Comparison(2, "soft", "peak Fn (N), same impact", 64.5, 64.9, 0.1, -0.6),
        Comparison(3, "soft", "peak Fn (N), same impact", 80.7, 94.2, None, -14.3),
    ]
    steps = (("reduced", 80.7), ("flat end", 80.5), ("sphere", 93.5), ("own contact", 94.2))
    causes = [cause_of(step, peak) for step, peak in steps]
    ladder = Ladder(False, rows, causes)
    record = make_record(model="fem3d", variant="ls-dyna-like", peak=66.0)
    other = make_record(model="fem3d", variant="fast", peak=60.0)
    paper = paper_rung(Runs((make_record(variant="N=60"), record, other)))
    assert {row.rung for row in paper} == {4}
    peak = next(row for row in paper if row.quantity == "peak Fn (N), own flight")
    assert peak.reference_uncertainty == pytest.approx(6.0)
    tables = table_rows(ladder, Runs((make_record(variant="N=60"), record, other)))
    assert tables["ladder"] == [*rows, *paper]
    write_tables(tmp_path, tables)
    header = (tmp_path / "ladder.csv").read_text().splitlines()[0]
    assert header == ",".join(Comparison.__annotations__)
    assert header == "rung,scene,quantity,reduced,reference,reference_uncertainty,error_percent"
    said = [*peak_sentences(tables["ladder"]), *cause_sentences(tables["ladder_causes"])]
    assert "0.6 % below the solid's (known to 0.15 %)" in said[0]
    assert "14.3 % below" in said[1]
    assert "from the blind prediction's 80.7 N to the 94.2 N of rung 3's reference" in said[2]
    assert "it is +13.5 N: +13.0 N with sphere, +0.7 N with own contact" in said[2]
    (title, _, first), *_ = ladder_context(ladder, tables)["ladder_rungs"]
    assert title.startswith("Rung 2")
    assert first == rows[:1]


@pytest.mark.parametrize(("stated", "known"), [(None, 33.0), (1.0, 33.0), (34.0, 34.0)])
def test_rung_fours_reference_is_known_to_no_less_than_its_distance_from_other_meshes(
    stated: float | None, known: float, make_record: Make
) -> None:
    """Half the range about a number at its end left the finest mesh outside."""
    errors = {} if stated is None else {"peak_normal_force_N": stated}
    reference = make_record(model="fem3d", variant="ls-dyna-like", peak=66.0, errors=errors)
    others = [
        make_record(model="fem3d", variant=name, peak=peak)
        for name, peak in (("contact", 99.0), ("fast", 65.0))
    ]
    rows = paper_rung(Runs((make_record(variant="N=60"), reference, *others)))
    peak = next(row for row in rows if row.quantity == "peak Fn (N), own flight")
    assert (peak.reference, peak.reference_uncertainty) == pytest.approx((66.0, known))


def test_what_the_run_states_is_known_without_other_meshes(make_record: Make) -> None:
    stated = {"peak_normal_force_N": 2.0}
    reference = make_record(model="fem3d", variant="ls-dyna-like", errors=stated)
    rows = paper_rung(Runs((make_record(variant="N=60"), reference)))
    known = [row.quantity for row in rows if row.reference_uncertainty is not None]
    assert known == ["peak Fn (N), own flight"]


def test_sentence_says_what_each_models_own_flight_adds() -> None:
    peaks = (("same impact", -0.6), ("own flight", 2.4))
    rows = [Comparison(2, "soft", f"peak Fn (N), {start}", 1.0, 1.0, None, e) for start, e in peaks]
    (said,) = peak_sentences(rows)
    assert "0.6 % below the solid's; +2.4 % where each falls by itself" in said


def test_what_is_further_apart_than_the_peak_is_said(make_record: Make) -> None:
    """A peak 1.6 % below hid a duration 18.4 % below; what the reference does not know is not."""
    known = {"peak_normal_force_N": 0.1, "contact_duration_s": 1e-6, "normal_impulse_N_s": 1.0}
    run, solid = make_record(peak=61.0), make_record(model="fem3d", peak=62.0, errors=known)
    run.summary.update({"contact_duration_s": 175e-6, "normal_impulse_N_s": 7e-3})
    solid.summary.update({"contact_duration_s": 215e-6, "normal_impulse_N_s": 9e-3})
    (said,) = peak_sentences(compare_runs(2, run, solid, {}, SAME))
    assert "Further apart than the reference is uncertain: contact duration 18.6 % below." in said


def test_tables_two_and_three_stand_beside_the_papers(make_record: Make) -> None:
    reference = make_record("hard", "fem3d", "ls-dyna-like", peak=80.0)
    runs = Runs((make_record("hard", variant="N=60", peak=76.0), reference))
    peaks, costs = paper_rows(runs, TABLE_2), paper_rows(runs, TABLE_3)
    row = next(r for r in peaks if (r["scene"], r["quantity"]) == ("hard", "peak Fn"))
    # The paper's Table 2: 173.084 N against LS-DYNA's 173.104 N, 0.012 %.
    assert (row["hcm"], row["hcm_paper"]) == (76.0, 173.084)
    assert (row["reference"], row["reference_paper"]) == (80.0, 173.104)
    assert row["error_percent"] == pytest.approx(-5.0)
    assert row["error_percent_paper"] == 0.012
    time = next(r for r in costs if (r["scene"], r["quantity"]) == ("hard", "solve time"))
    # Its Table 3: 247 s against 21,473 s.
    assert (time["hcm_paper"], time["reference_paper"]) == (247, 21473)
    assert time["reference_over_hcm"] == pytest.approx(200.0)
    assert time["reference_over_hcm_paper"] == pytest.approx(86.94, abs=0.01)
    absent = [r for r in (*peaks, *costs) if r["scene"] == "soft"]
    assert len(absent) == 4
    assert all(r["hcm"] is None and r["hcm_paper"] is not None for r in absent)


def test_holes_for_shafts_are_a_row_and_no_part_of_the_spread(make_record: Make) -> None:
    plain = make_record(model="fem3d", variant="ls-dyna-like", peak=80.0)
    holed = make_record(model="fem3d", variant="ls-dyna-like shaft holes", peak=81.0)
    runs = Runs((plain, holed))
    (row,) = shaft_holes(runs)
    assert (row["scene"], row["peak_N"], row["changed_peak_N"]) == ("soft", 80.0, 81.0)
    assert row["peak_percent"] == pytest.approx(1.25)
    assert row["duration_percent"] == 0.0
    (said,) = check_sentences([row])
    assert "with shaft holes instead of plain hinges: peak force +1.25 %" in said
    assert runs.spread_over("soft") == [plain]
    jobs = [job for group in paper_jobs("soft") for job in group]
    (job,) = [job for job in jobs if job.variant == holed.variant]
    assert any(text.startswith("solver.fem.shaft_radius") for text in job.overrides)


def test_whole_event_is_compared_with_the_rigid_start(
    monkeypatch: Patch, make_record: Make
) -> None:
    asked = []

    def contact(scene: NamedScene, start: Any, variant: str) -> RunRecord:
        asked.append(scene.tables.solver.fem.flight)
        return make_record(scene.name, "fem3d", variant, peak=100.0 - 0.02 * (len(asked) - 1))

    monkeypatch.setattr(ladder_module, "full_contact", contact)
    row = explicit_flight("soft", LadderRuns())
    assert asked == [None, "explicit"]
    assert row["change"] == "whole event by 3,000 explicit steps instead of a rigid flight"
    assert row["peak_percent"] == pytest.approx(-0.02)


def test_patch_and_pressure_stand_beside_hertz(make_record: Make) -> None:
    run = make_record(model="fem3d", variant="fast", peak=100.0)
    size = run.history["normal_force_N"]
    run.history["contact_area_m2"] = 1e-8 * size
    run.history["peak_pressure_Pa"] = 1e6 * size
    (row,) = contact_patches(Runs((run, make_record())), ())
    # Soft: E* = 1e9/0.84 Pa, R = 7.5 mm: a³ = 0.75 * 100 N R/E*, mean pressure 2/3 p_0.
    hertz = (0.75 * 100 * 0.0075 * 0.84 / 1e9) ** (1 / 3)
    assert row["hertz_radius_um"] == pytest.approx(1e6 * hertz, rel=1e-6)
    assert row["hertz_pressure_MPa"] == pytest.approx(1.5e-4 / (np.pi * hertz**2), rel=1e-6)
    assert row["radius_um"] == pytest.approx(1e6 * np.sqrt(1e-6 / np.pi), rel=1e-6)
    assert row["pressure_MPa"] == pytest.approx(100.0, rel=1e-6)


def test_accuracy_against_cost_is_ordered_by_time(make_record: Make) -> None:
    plane = make_record(model="fem2d", variant="fast", peak=70.0)
    runs = Runs((make_record(variant="N=60", peak=60.0), plane))
    best = make_record(model="fem3d", variant="preset converged", peak=80.0)
    plane.summary["wall_time_s"] = 3.0
    rows = accuracy_against_cost(runs, [make_record(peak=76.0)], [best])
    assert [(row["model"], row["peak_percent"]) for row in rows] == [
        ("hcm, the scene's k", pytest.approx(-25.0)),
        ("hcm, identified k", pytest.approx(-5.0)),
        ("fem2d fast", pytest.approx(-12.5)),
        ("fem3d preset converged", 0.0),
    ]


def test_what_is_known_best_is_the_line_of_no_difference(make_record: Make) -> None:
    """A run of rung 3 whose peak was a spike, +-17 %, made one known to 0.7 % be -9.8 % off."""
    own = make_record(model="fem3d", variant="contact", peak=72.0)
    spike = make_record(model="fem3d", variant="edge 0.12 mm", peak=80.0)
    for stated, lines in (((0.5, 13.0), (0.0, 80 / 72 - 1)), ((5.0, 1.0), (72 / 80 - 1, 0.0))):
        own, spike = (
            replace(run, errors={"peak_normal_force_N": error})
            for run, error in zip((own, spike), stated, strict=True)
        )
        rows = accuracy_against_cost(Runs((own,)), [], [spike])
        found = {row["model"]: row["peak_percent"] for row in rows}
        assert [found["fem3d contact"], found["fem3d edge 0.12 mm"]] == pytest.approx(
            [100 * line for line in lines]
        )


def test_rung_threes_reference_tells_its_doubts(make_record: Make) -> None:
    spike = replace(make_record(model="fem3d", variant="fine"), message="a spike")
    assert Ladder(False, references=[spike, make_record()]).doubts == [
        "soft, rung 3's fem3d fine: a spike"
    ]


def test_errors_of_the_flight_are_those_that_the_reference_states(make_record: Make) -> None:
    """All meshes fly alike: by their range an arrival was known to 3 ps."""
    coarse = make_record(model="fem3d", peak=60.0)
    stated = {"contact_time_s": 2e-6, "peak_normal_force_N": 0.6}
    solid = replace(make_record(model="fem3d", peak=60.0), errors=stated)
    shares = uncertainties((2e-3, 1e-3), (coarse, solid))
    rows = {row.quantity: row for row in compare_runs(2, make_record(), solid, shares, OWN)}
    arrival = rows["time of first contact (ms), own flight"]
    assert arrival.reference_uncertainty == pytest.approx(2e-3)
    peak = rows["peak Fn (N), own flight"]
    assert peak.reference_uncertainty == pytest.approx(0.01 * peak.reference)


def test_the_papers_reference_is_known_to_its_other_meshes_arrival(make_record: Make) -> None:
    """Each mesh of rung 4 has a flight of its own."""
    record, other = (make_record(model="fem3d", variant=v) for v in ("ls-dyna-like", "fast"))
    other.summary["contact_time_s"] = record.summary["contact_time_s"] + 1e-3
    rows = paper_rung(Runs((make_record(variant="N=60"), record, other)))
    arrival = next(row for row in rows if row.quantity.startswith("time of first contact"))
    assert arrival.reference_uncertainty == pytest.approx(1.0)


def test_a_scene_that_fails_is_named_and_the_others_go_on(
    monkeypatch: Patch,
) -> None:
    def fail(scene: Any, impact: Any, full: bool, runs: LadderRuns) -> list[Comparison]:
        raise RunFailedError(f"{scene.name} broke")

    monkeypatch.setattr(rungs, "structure_rung", fail)
    ladder = compute_ladder(("soft", "hard"), False, Path("nowhere"))
    told = "{0}: the ladder, whose models start from the impact of thin rods, ends early: {0} broke"
    assert ladder.failures == [told.format("soft"), told.format("hard")]
    assert ladder.rows == []


@pytest.mark.parametrize("name", ["soft", "hard"])
@pytest.mark.parametrize("mesh", CONTACT)
def test_meshes_of_rung_three_start_above_the_surface(name: str, mesh: tuple[float, ...]) -> None:
    scene = load_scene(name)
    impact = impact_of(scene)
    keys, _ = mesh_keys(mesh, 0.015)
    solid, _ = touching_meshes(load_scene(name, keys), impact)
    hinge, angle = -0.08, impact.angles[-1]  # of the last of three phalanges of 40 mm
    height = -0.04 * np.sin(impact.angles[:-1]).sum() + impact.sphere_height_m
    tip = solid.points[np.unique(solid.cells[solid.cell_sets["phalanx_3"]])]
    lowest = height + (np.sin(angle) * (tip[:, 0] - hinge) + np.cos(angle) * tip[:, 1]).min()
    assert 0.0 < lowest < 5e-6  # the clearance of 1.5 um, less a node's sagitta and the lead's way


@pytest.mark.slow
@pytest.mark.parametrize("name", ["soft", "hard"])
def test_rung_two_beams_agree_with_solids_to_two_percent(name: str) -> None:
    scene = load_scene(name)
    rows = {
        row.quantity: row for row in structure_rung(scene, impact_of(scene), True, LadderRuns())
    }
    peak = rows[f"peak Fn (N), {SAME}"]
    # Within 2 % of the converged solid, whose own error is far below that.
    assert abs(peak.error_percent) < 2.0
    assert peak.reference_uncertainty < 0.005 * peak.reference
    own = rows[f"tip velocity vy at contact (m/s), {OWN}"]
    # Rotary inertia takes 2.5 % of the speed.
    assert own.error_percent == pytest.approx(2.5, abs=0.3)


@pytest.mark.parametrize("mesh", [None, (0.0267, 1.6, 0.1, 0.167)])
def test_a_rungs_mesh_is_that_of_a_scene_that_states_an_accuracy(
    mesh: tuple[float, ...] | None,
) -> None:
    """A preset beside an accuracy would be refused, and with it all rungs of all scenes."""
    keys, _ = mesh_keys(mesh, 0.015)
    assert sizes_of(load_scene("soft", ["solver.accuracy=0.01", *keys]).tables) is None


def test_what_a_solid_refuses_costs_the_ladder_one_scene() -> None:
    scene = load_scene("soft", ["solver.fem.preset=converged", "solver.fem.accuracy=0.01"])
    with pytest.raises(UserError, match=r"solver\.fem\.preset = 'converged'"):
        LadderRuns().obtain(full_contact, scene, None, "refused")


TIP = ContactIdentification(
    scene="soft", force_N=90.0, normal_stiffness_N_per_m=2e5, eta_squared=1.25, stiffness=None,
    ratio=None, hertz_N_per_m=2e5, mindlin_eta_squared=1.2, scene_normal_stiffness_N_per_m=1e5,
    scene_eta_squared=1.0, touch_angle_deg=30.0, round_touch_angle_deg=30.0, levels=(),
    tip_compliance={}, curve={}, cautions=(),
)  # fmt: skip


@dataclass(frozen=True)
class Asked(LadderRuns):
    """A half sine in the place of each run; keeps what was asked for, by the run's function.

    solids : peaks and numbers of elements of the solids' runs, in turn; then 64 N of 4,000.
    """

    make: Make = RunRecord
    solids: list[tuple[float, int]] = field(default_factory=list)
    asked: list[tuple[str, tuple[Any, ...]]] = field(default_factory=list)

    def obtain(self, simulate: Any, scene: NamedScene, *given: Any, **named: Any) -> RunRecord:
        self.asked.append((simulate.__name__, given))
        if simulate is reduced:
            return self.make(scene.name)
        peak, count = self.solids.pop(0) if self.solids else (64.0, 4000)
        return self.make(scene.name, "fem3d", peak=peak).with_summary(elements=count)

    def contacts(self, name: str) -> list[Contact]:
        """The lumped laws that a function was asked to run with."""
        return [given[0] for asked, given in self.asked if asked == name]


def test_a_structures_edges_are_the_cube_roots_of_its_numbers_of_elements(
    make_record: Make,
) -> None:
    """64 + h^2 on meshes of 8 times the elements each: a GCI of 1.25/65 of the second order."""
    solids = 2 * [(80.0, 1000), (68.0, 8000), (65.0, 64000)]
    scene = load_scene("soft")
    rows = structure_rung(scene, impact_of(scene), True, Asked(make=make_record, solids=solids))
    peak = next(row for row in rows if row.quantity == f"peak Fn (N), {SAME}")
    assert peak.reference_uncertainty == pytest.approx(1.25, rel=1e-6)


def test_rung_three_takes_the_identified_law_and_the_studys_error_bars(make_record: Make) -> None:
    scene = load_scene("soft")
    runs = Asked(make=make_record)
    stored = {"peak_normal_force_N": 0.25, "contact_time_s": 0.5}
    rows, *_ = rungs.contact_rung("soft", scene, impact_of(scene), TIP, stored, False, runs)
    assert runs.contacts("reduced") == [Contact(2e5, 0.8)] * 2
    by_name = {row.quantity: row for row in rows}
    for start in (SAME, OWN):
        assert by_name[f"peak Fn (N), {start}"].reference_uncertainty == 16.0  # 0.25 of 64 N
    # the meshes all begin at the impact: what they agree on is not how well the arrival is known
    assert by_name[f"time of first contact (ms), {OWN}"].reference_uncertainty is None


def test_causes_change_one_thing_each(make_record: Make) -> None:
    scene = load_scene("soft")
    runs = Asked(make=make_record)
    steps = rungs.causes(scene, impact_of(scene), TIP, make_record(model="fem3d"), runs)
    linear, hertz = Contact(2e5, 0.8), Contact(2e5, 0.8, 90.0)
    assert runs.contacts("reduced") == [linear]
    assert runs.contacts("lumped_solid") == [linear, linear, hertz]
    ends = [given[3:] for asked, given in runs.asked if asked == "lumped_solid"]
    assert ends == [(), ("hemisphere",), ("hemisphere",)]
    assert len(steps) == 5


@pytest.mark.parametrize(("hertz_force", "restitution"), [(None, 0.5), (90.0, 1.0)])
def test_a_lumped_law_after_hertz_has_no_losses(
    hertz_force: float | None, restitution: float, monkeypatch: Patch
) -> None:
    laws = []

    def simulate(*given: Any, **named: Any) -> None:
        laws.append(given[4].contact)
        raise RunFailedError("seen")

    monkeypatch.setattr(reference_fem, "simulate", simulate)
    scene = load_scene("soft", ["tip.restitution=0.5"])
    with pytest.raises(RunFailedError, match="seen"):
        lumped_solid(scene, Contact(2e5, 0.8, hertz_force), None, (0.2, 0.3))
    assert [law.restitution for law in laws] == [restitution]


def test_an_identification_on_one_mesh_is_not_that_on_three(
    monkeypatch: Patch, tmp_path: Path
) -> None:
    asked = []

    def identified(scene: NamedScene, meshes: tuple[Any, ...]) -> ContactIdentification:
        asked.append(len(meshes))
        return TIP

    identified.__module__ = identify_contact.__module__
    monkeypatch.setattr(ladder_module, "identify_contact", identified)
    for meshes in (MESHES[:1], MESHES, MESHES[:1]):
        found = ladder_module.identify(load_scene("soft"), meshes, Store(tmp_path))
        assert found == TIP
    assert asked == [1, 3]


def test_a_rungs_mesh_has_each_edge_where_it_belongs_and_a_later_arrival_is_positive(
    make_record: Make,
) -> None:
    (tip, growth, section, axial), diameter = CONTACT[0], 0.03
    fem = load_scene("soft", mesh_keys(CONTACT[0], diameter)[0]).tables.solver.fem
    assert fem.growth == growth
    edges = np.array([fem.tip_size, fem.section_size, fem.axial_size])
    np.testing.assert_allclose(edges / diameter, [tip, section, axial])
    plain = make_record(model="fem3d")
    later = plain.with_summary(contact_time_s=1.25 * plain.value("contact_time_s"))
    assert check_row("one", "fast", plain, later)["contact_time_percent"] == pytest.approx(25.0)
