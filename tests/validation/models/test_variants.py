"""The models between the paper's assumptions and the refined ones."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from hcm import Assumptions
from tests.validation.commands import Patch, Run
from validation.models.hcm import HCM, HCM_REFINED
from validation.models.variants import ORDER, Variant, all_variants, cumulative, leave_one_out
from validation.peers import exudyn_model
from validation.scenes.load import load_scene
from validation.validate.plan import assumption_jobs


def test_one_assumption_after_the_other_becomes_the_refined_ones() -> None:
    steps = cumulative()
    assert steps[0].refined == frozenset()
    assert steps[-1].refined == frozenset(ORDER)
    for before, after in pairwise(steps):
        assert len(after.refined - before.refined) == 1


@pytest.mark.parametrize("variant", [*cumulative(), *leave_one_out()], ids=lambda v: v.name)
def test_each_is_a_scene_that_can_be_run(variant: Variant) -> None:
    table = load_scene("soft", variant.overrides).tables.solver.hcm
    stated = Assumptions(**{s: getattr(table, s) for s in (*ORDER, "whole_tap")})
    assert {switch for switch in ORDER if stated.has(switch)} == variant.refined
    assert stated.has("whole_tap")


def test_what_needs_an_assumption_goes_with_it() -> None:
    names = [variant.name for variant in leave_one_out()]
    tip = ("partial_slip", "tip_compliance", "deforming_tip", "growing_patch", "radiating_tip")
    after = " and ".join(tip)
    assert f"without hertz and {after}" in names
    assert len(set(names)) == len(ORDER)


def test_the_refined_model_has_what_a_scene_does_not_switch() -> None:
    keys = ("finger.phalanges=1", "finger.elements=2", "surface.height=0.01")

    def peak(model: Any, *more: str) -> float:
        record = model.run(load_scene("soft", (*keys, "solver.hcm.estimate=false", *more))).record
        assert (record.ok, record.model) == (True, model.name)
        return float(record.summary["peak_normal_force_N"])

    refined = peak(HCM_REFINED)
    assert refined == peak(HCM, "solver.hcm.assumptions='refined'") != peak(HCM)
    without = "solver.hcm.half_ball=false"
    assert refined != peak(HCM_REFINED, without)
    assert peak(HCM_REFINED, without) == peak(HCM, "solver.hcm.assumptions='refined'", without)


WITHOUT_TIP = """
finger = {length = 0.04, diameter = 0.015}
material = {youngs_modulus = 1e9, density = 1400.0, poisson_ratio = 0.4}
surface = {height = 0.1, friction = 0.5}
"""


def test_a_scene_without_a_tip_is_for_what_has_no_spring(
    tmp_path: Path, fingertap: Run, monkeypatch: Patch
) -> None:
    """hcm, and what begins with its assumptions, say so before anything is solved."""
    path = tmp_path / "bare.toml"
    path.write_text(WITHOUT_TIP)
    scene = load_scene(str(path))
    missing = "tip.normal_stiffness is missing: the paper's reduced model"
    assert HCM.refusal(scene).startswith(missing)
    assert not HCM_REFINED.refusal(scene)
    assert not HCM.refusal(load_scene(str(path), ("solver.hcm.assumptions=refined",)))
    # a patch that slips as a whole has a tangential spring
    whole = load_scene(str(path), ("solver.hcm.partial_slip=false",))
    assert HCM_REFINED.refusal(whole).startswith(missing)
    monkeypatch.setattr(exudyn_model, "installed", lambda name: True)
    assert exudyn_model.refusal(scene).startswith("tip.normal_stiffness is missing")
    # assumptions that do not fit together are the user's to mend, not a failure of the model
    alone = ("run", path, "--model", "hcm", "--set", "solver.hcm.partial_slip=true")
    assert "needs hertz" in fingertap(*alone, "--out", tmp_path).refusal
    new = fingertap("new", tmp_path / "new.toml", "--like", path).out
    assert "--model hcm-refined" in new
    for command in ("run", "validate", "waterfall"):
        model = ["--model", "hcm"] if command == "run" else []
        assert missing in fingertap(command, path, *model, "--out", tmp_path).refusal
    variants = {job.variant for job in assumption_jobs(str(path))}
    assert {"+ partial_slip", "without shear"} < variants
    assert variants.isdisjoint({"paper", "+ hertz", "without partial_slip"})
    assert len(assumption_jobs("soft")) == len(all_variants())
