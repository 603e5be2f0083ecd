"""What ``fingertap validate`` may be asked for, and what its checks say to a machine."""

import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest
import tomli_w

from tests.validation.commands import Make, Patch, Run
from validation.compare.differences import (
    Difference,
    Verdict,
    differences_of,
    error_percent,
    judge,
    thousands_apart,
    turned,
)
from validation.curve_files.read import Reference
from validation.errors import UserError
from validation.harness.quantities import quantity
from validation.harness.record import RunRecord
from validation.models.hcm import hcm_scene
from validation.models.solid_mesh import sizes_of
from validation.scenes.load import load_scene
from validation.scenes.solver_tables import DEFAULT_ACCURACY
from validation.validate import command as validate_command
from validation.validate.headline import cautions, sentences, unit_notes
from validation.validate.ladder.ladder import Ladder
from validation.validate.plan import PAPER_REDUCED, Plan, Runs, paper_jobs, validation_jobs
from validation.validate.request import plan_of, read_tolerances


@pytest.mark.parametrize(
    ("errors", "tolerance", "judgement", "check"),
    [
        ((1.0, 1.0), None, "resolved", None),  # u = 1.41 %, E = 2 %
        ((2.0, 0.1), None, "within uncertainty", None),
        ((None, 0.1), None, "cannot tell", None),
        ((float("inf"), 0.1), 5.0, "cannot tell", "cannot tell"),
        ((1.0, 1.0), 3.0, "resolved", "inside"),
        ((0.5, 0.5), 1.0, "resolved", "outside"),
        ((1.0, 1.0), 1.0, "resolved", "cannot tell"),  # u is above the tolerance
    ],
)
def test_verdict_is_e_against_u(
    errors: tuple[float | None, float], tolerance: float | None, judgement: str, check: str | None
) -> None:
    verdict = judge(102.0, 100.0, *errors, tolerance)
    assert verdict is not None
    assert verdict.difference == pytest.approx(2.0)
    assert (verdict.judgement, verdict.check) == (judgement, check)
    assert judge(None, 1.0, *errors) is None
    assert judge(1.0, 0.0, *errors) is None
    assert judge(0.0, 0.0, *errors) is None
    frictionless = judge(0.0, 0.0, 0.0, 0.0, 5.0)
    assert frictionless is not None
    assert (frictionless.difference, frictionless.check) == (0.0, "inside")
    assert frictionless.judgement == "within uncertainty"


def test_each_error_stands_beside_its_number() -> None:
    entry = quantity("peak_normal_force_N")
    found = Difference("soft", "hcm", entry, 102.0, 100.0, 0.5, 2.0).numbers
    assert (found["reduced_error"], found["reference_error"]) == (0.5, 2.0)
    assert found["uncertainty_percent"] == pytest.approx(math.hypot(0.5, 2.0))


def test_a_unit_or_a_sign_is_suspected_of_numbers_alike_but_for_it_alone() -> None:
    """To a factor of two: 2.28 decades are neither three nor none, 31 is three times 10."""
    assert thousands_apart(0.15, 95.0) == -1
    assert thousands_apart(0.5, 95.0) == thousands_apart(50.0, 95.0) == 0
    assert turned(15.0, -10.0)
    assert not turned(31.0, -10.0)
    assert not turned(15.0, 10.0)


def test_a_difference_of_small_numbers_is_in_percent_too() -> None:
    assert error_percent(10.0, 0.05) == pytest.approx(19900.0)
    assert error_percent(10.0, 1e-9) is None


def test_a_smaller_magnitude_is_a_negative_difference_whatever_the_sign() -> None:
    verdict = judge(-30.0, -40.0, 1.0, 1.0)
    assert verdict is not None
    assert verdict.difference == pytest.approx(-25.0)  # S - D = 10 over D = -40
    assert verdict.uncertainty == pytest.approx(100.0 * math.sqrt(2.0) / 40.0)


def test_a_scene_keeps_its_letters_and_equal_models_are_said_so(make_record: Make) -> None:
    same, off = make_record(peak=64.0), make_record(peak=64.64)
    rows = [one for run in (same, off) for one in differences_of("PLA_v2", "hcm", run, same)]
    told = "PLA_v2 finger: the reduced model's peak force lies {}"
    told += " (one of their errors is not known: not judged)."
    sides = ("within 0.05 % of the reference's", "1.0 % above the reference's")
    assert sentences(rows) == [told.format(side) for side in sides]


@pytest.mark.parametrize(
    ("value", "power"), [(0.09, -1), (95e3, 1), (60e6, 2), (60.0, 0), (300.0, 0), (0.0, 0)]
)
def test_unit_slips_are_powers_of_a_thousand(value: float, power: int) -> None:
    assert thousands_apart(value, 95.0) == power


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nosuch",), "scene 'nosuch': unknown"),
        (("soft", "soft"), "another scene is called soft"),
        (("own/soft.toml", "own/soft.toml"), "another scene is called soft.toml"),
        (("--models", "hcm,nosuch"), "--models 'nosuch': unknown"),
        (("--models", "hcm,hcm"), "named twice"),
        (("--models", "fem3d"), "is the reference as well"),
        (("--models", ""), "--models '': a name is missing"),
        (("--models", "hcm,"), "--models 'hcm,': a name is missing"),
        (("--models", ","), "--models ',': a name is missing"),
        (("--reference", "ls-dyna"), "--reference 'ls-dyna': unknown"),
        (("--reference", ""), "--reference '': unknown"),
        (("--reference", "own"), "--reference own: is a folder"),
        (("driven-1", "--models", "exudyn"), "scene driven-1, model exudyn: exudyn "),
        (("--tolerance", "peak=5,peak=1"), "appears twice"),
        (("--tolerance", ","), "--tolerance ',': must be NAME=PERCENT"),
        (("--tolerance", "peak=5,"), "--tolerance 'peak=5,': must be NAME=PERCENT"),
        (("--tolerance", "peak"), "must be NAME=PERCENT"),
        (("--tolerance", "peak=0"), "must be NAME=PERCENT"),
        (("--tolerance", "peak=-5"), "must be NAME=PERCENT"),
        (("--tolerance", "peak=nan"), "must be NAME=PERCENT"),
        (("--tolerance", "peak=five"), "must be NAME=PERCENT"),
        (("--tolerance", "height=5"), "unknown quantity; known are peak, impulse"),
    ],
)
def test_bad_request_is_refused_before_anything_runs(
    arguments: tuple[str, ...], words: str, tmp_path: Path, monkeypatch: Patch, fingertap: Run
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own").mkdir()
    Path("own/soft.toml").write_text("[finger]\nphalanges = 1\nlength = 0.1\ndiameter = 0.01\n"
                                     "[material]\nyoungs_modulus = 1e9\ndensity = 1e3\n"
                                     "poisson_ratio = 0.3\n[surface]\nheight = 0.05\n"
                                     "friction = 0\n[tip]\nnormal_stiffness = 1e6\n")  # fmt: skip
    assert words in fingertap("validate", *arguments).refusal
    assert not Path("out").exists()


def test_a_folder_called_as_a_model_is_none_of_its_business(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("fem3d").mkdir()
    assert plan_of(["soft"], "hcm", "fem3d", "").reference == "fem3d"


def test_tolerances_take_short_names_and_keys() -> None:
    wanted = {"peak_normal_force_N": 5.0, "contact_time_s": 0.5}
    assert read_tolerances("peak=5, contact_time_s=0.5") == wanted
    assert read_tolerances("") == {}


def test_plan_runs_the_paper_in_full_and_others_alone() -> None:
    paper = validation_jobs(plan_of((), "hcm", "fem3d", ""))
    assert {job.scene for group in paper for job in group} == {"hard", "soft"}
    assert sum(len(group) for group in paper) == 22
    alone = validation_jobs(plan_of(("soft",), "hcm", "fem2d", ""))
    assert [(job.model, job.variant) for group in alone for job in group] == [
        ("hcm", None),
        ("fem2d", None),
    ]
    wanted = [load_scene("soft", group[0].overrides).tables.solver for group in alone]
    asked = [wanted[0].accuracy_of("hcm"), wanted[1].accuracy_of("fem")]
    assert asked == [DEFAULT_ACCURACY["hcm"], DEFAULT_ACCURACY["fem"]]
    refined = validation_jobs(plan_of(("soft",), "hcm-refined", "fem2d", ""))
    assert [len(group) for group in refined] == [1, 1, 12 + 11]  # step by step, and each left out


@pytest.mark.parametrize(
    "stated",
    [
        "solver.fem.mesh=mine.vtu",
        "solver.fem.preset=fast",
        "solver.fem.contact=impulse",
        "solver.fem.shaft_radius=2e-3",
        "solver.fem.tip_size=1e-3",
        "solver.fem.growth=1.5",
        "solver.hcm.assumptions=refined",
        "solver.hcm.shear=true",
    ],
)
def test_what_the_papers_comparison_varies_stands_alone(stated: str, tmp_path: Path) -> None:
    """Its runs on other presets, holes and laws would fail, or be the scene's own by other names;
    a ladder's spring is none of a refined tip's."""
    path = replaced_scene(tmp_path / "mine.toml", stated)
    plan = plan_of((str(path),), "hcm", "fem3d", "")
    assert [(job.model, job.variant) for group in validation_jobs(plan) for job in group] == [
        ("hcm", None),
        ("fem3d", None),
    ]
    assert plan.notes == [
        "the paper's comparison, over several meshes, is left out: mine states "
        + stated.partition("=")[0]
    ]
    assert plan_of((str(path),), "hcm", "hcm-refined", "").notes == []


def test_a_neo_hookean_scene_is_compared_without_plane_stress(tmp_path: Path) -> None:
    """Its run failed, and with it the command."""
    path = replaced_scene(tmp_path / "silicone.toml", "material.law=neo-hooke")
    plan = plan_of((str(path),), "hcm", "fem3d", "")
    models = {job.model for group in validation_jobs(plan) for job in group}
    assert models == {"hcm", "fem3d"}
    (note,) = [note for note in plan.notes if "plane stress" in note]
    assert note.startswith("silicone: plane stress (fem2d) is left out: material.law = 'neo-hooke'")
    with pytest.raises(UserError, match="silicone, model fem2d: material"):
        plan_of((str(path),), "hcm", "fem2d", "")
    assert plan_of(("soft",), "hcm", "fem3d", "").notes == []


def test_the_papers_jobs_state_what_they_rely_on(tmp_path: Path) -> None:
    """Whatever the default, and whatever the scene asks for, to the fields of the solver's call.

    A preset beside an accuracy would be refused.
    """
    document = replaced_scene(tmp_path / "held.toml", "solver.accuracy=5e-3")
    for source in ("soft", str(document)):
        jobs = {job.variant: job for group in paper_jobs(source) for job in group}
        for count, variant in ((20, "N=60"), (10, "N=30"), (5, "N=15")):
            scene = load_scene(source, jobs[variant].overrides)
            assert scene.tables.solver.accuracy_of("hcm") is None
            alone = load_scene("soft", [f"finger.elements={count}"])
            estimate = variant == PAPER_REDUCED.variant
            assert hcm_scene(scene, estimate=True) == hcm_scene(alone, estimate=estimate)
        for variant in ("ls-dyna-like", "ls-dyna-like shaft holes", "fast", "fast penalty 1.6"):
            tables = load_scene(source, jobs[variant].overrides).tables
            assert sizes_of(tables) is None
    for source, asked in (("soft", DEFAULT_ACCURACY), (str(document), {"hcm": 5e-3, "fem": 5e-3})):
        for model in asked:  # what the scene states wins
            own = [group[0] for group in paper_jobs(source) if group[0].model.startswith(model)]
            solver = load_scene(source, own[0].overrides).tables.solver
            assert solver.accuracy_of(model) == asked[model]


def replaced_scene(path: Path, change: str) -> Path:
    """The soft scene with a change, as a file."""
    path.write_text(tomli_w.dumps(load_scene("soft", [change]).document))
    return path


def test_checks_end_with_their_own_code_in_json_and_junit(
    make_record: Make, monkeypatch: Patch, tmp_path: Path, fingertap: Run
) -> None:
    stated = {"peak_normal_force_N": 0.4, "normal_impulse_N_s": 1e-9}
    records = (
        replace(make_record(peak=60.0), errors=stated, message="it is wet"),
        replace(make_record("soft", "fem3d", "contact", 62.0), errors=stated),
    )

    def run_all(folder: Path, plan: Plan, *rest: object) -> Runs:
        return Runs(records, plan)

    monkeypatch.setattr(validate_command, "run_all", run_all)
    monkeypatch.setattr(validate_command, "isolated_ladder", lambda *a: Ladder(False))
    parts = (
        "sentences",
        "reasons",
        "ladder_sentences",
        "render_problems",
        "unit_notes",
        "cautions",
    )
    page: dict[str, list[str]] = {part: [] for part in parts}
    page |= {"unit_notes": ["in mN?"], "cautions": ["soft, hcm: it is wet"]}
    monkeypatch.setattr(validate_command, "report", lambda *a: page)
    wanted = ("validate", "soft", "--models", "hcm", "--out", tmp_path, "--tolerance")
    assert fingertap(*wanted, "peak=5,impulse=5").code == 0
    ended = fingertap(*wanted, "peak=2,impulse=5,stress=1")
    assert ended.code == 3
    *cautions, last = ended.err.splitlines()
    assert cautions == ["fingertap: caution: in mN?", "fingertap: caution: soft, hcm: it is wet"]
    assert "2 of 3 checks" in last
    assert "soft, hcm: peak Fn -3.23 % (known to 0.91 %), tolerance 2 %: outside" in last
    suite = ET.parse(tmp_path / "validate" / "junit.xml").getroot()
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("3", "2", "0")
    printed = fingertap(*wanted, "peak=2,impulse=5,stress=1", "--json")
    written = json.loads((tmp_path / "validate" / "validate.json").read_text())
    assert (json.loads(printed.out), printed.code) == (written, 3)
    assert written["cautions"] == ["in mN?", "soft, hcm: it is wet"]
    verdicts = written["verdicts"]
    found = {row["quantity"]: row["check"] for row in verdicts if row["tolerance_percent"]}
    assert found["peak_normal_force_N"] == "outside"
    assert found["normal_impulse_N_s"] == "inside"
    assert found["peak_stress_R_Pa"] == "cannot tell"


def test_numbers_in_another_unit_are_named(make_record: Make) -> None:
    mine: RunRecord = make_record(model="mine", peak=0.06)
    runs = Runs(
        (mine, make_record("soft", "fem3d", "contact", 62.0)), Plan({"soft": "soft"}, ("mine",))
    )
    (note,) = [text for text in unit_notes(runs) if "peak_normal_force_N" in text]
    assert note.startswith("soft, mine: peak_normal_force_N = 0.06 N is about 0.001 times")


@pytest.mark.parametrize(("reference", "told"), [("fem2d", True), ("fem3d", False)])
def test_a_body_in_plane_stress_is_named(reference: str, told: bool, make_record: Make) -> None:
    """47 % of a peak came "from the model", and nothing said that the bodies differ."""
    own = [make_record(model=model, variant="contact") for model in ("hcm", reference)]
    said = cautions(Runs(tuple(own), plan_of(("soft",), "hcm", reference, "")))
    assert any("fem2d is plane stress, another body than that of hcm" in t for t in said) is told


@pytest.mark.parametrize(("theirs", "told"), [(-30.0, True), (30.0, False), (-1.0, False)])
def test_a_tangential_force_along_the_other_axis_is_told(
    theirs: float, told: bool, make_record: Make
) -> None:
    """A column of the wrong sign was 197 % off in a long table, and nothing said so."""
    mine, data = make_record(), make_record("soft", "lab.csv")
    mine.summary["peak_tangential_force_N"] = 31.0
    data.summary["peak_tangential_force_N"] = theirs
    plan = Plan({"soft": "soft"}, ("hcm",), "lab.csv", {"soft": Reference(data, ())})
    notes = [text for text in unit_notes(Runs((mine, data), plan)) if "tangential" in text]
    assert len(notes) == told
    assert all("turn the sign of tangential in the TOML" in note for note in notes)


@pytest.mark.parametrize(
    ("models", "reference"), [("hcm", "fem2d"), ("fem2d", "fem3d"), ("hcm-refined", "hcm")]
)
def test_what_is_compared_and_what_with_is_measured(
    models: str, reference: str, make_record: Make
) -> None:
    """Whatever a solid calls its own run; runs between the two assumptions are not timed alone."""
    variant = {"hcm": "", "hcm-refined": ""}
    own = [make_record(model=m, variant=variant.get(m, "contact")) for m in (models, reference)]
    between = make_record(model="hcm", variant="refined but shear")
    runs = Runs((*own, between), plan_of(("soft",), models, reference, ""))
    assert runs.measured() == own


def test_a_difference_that_is_known_to_just_the_tolerance_is_judged() -> None:
    assert Verdict(1.0, 2.0, 2.0).check == "inside"
    assert Verdict(3.0, 2.0, 2.0).check == "outside"
    assert Verdict(3.0, 2.0001, 2.0).check == "cannot tell"


@pytest.mark.parametrize(("difference", "check"), [(103.2, "outside"), (4.9, "cannot tell")])
def test_a_difference_far_beyond_a_tolerance_is_outside_however_well_it_is_known(
    difference: float, check: str
) -> None:
    """An impulse of double the data's, known to 3 %, could not be told from 2 %."""
    verdict = Verdict(-difference, 3.0, 2.0)
    assert verdict.check == check
    assert verdict.judgement == Verdict(-difference, 3.0).judgement == "resolved"
