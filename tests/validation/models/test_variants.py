"""The models between the paper's assumptions and the refined ones."""

from itertools import pairwise
from typing import Any

import pytest

from hcm import Assumptions
from validation.models.hcm import HCM, HCM_REFINED
from validation.models.variants import ORDER, Variant, cumulative, leave_one_out
from validation.scenes.load import load_scene


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
