"""The paper's LS-DYNA column: what our reference says, and what that depends on."""

import pytest

from validation.harness.record import RunRecord
from validation.scenes.load import load_scene
from validation.studies.paper.validation_findings import (
    COARSE,
    CONVERGED,
    JUDGED,
    SOFTER,
    VARIANTS,
    penalty_for,
    sensitivity,
    value_of,
)

PEAK = "peak_normal_force_N"


def _record(force: float, elements: int = 4672) -> RunRecord:
    return RunRecord(
        "hard", "fem3d", "", "COMPLETED", True, "", {PEAK: force, "elements": elements}
    )


def test_every_variant_is_a_valid_scene() -> None:
    for overrides in VARIANTS.values():
        load_scene("hard", overrides)


def test_the_penalty_for_a_force_lies_on_the_power_law_through_two_runs() -> None:
    runs = {p: 300.0 * p**0.25 for p in (0.05, 0.1)}
    assert penalty_for(300.0 * 0.08**0.25, runs) == pytest.approx(0.08)
    assert penalty_for(-300.0 * 0.2**0.25, {p: -f for p, f in runs.items()}) == pytest.approx(0.2)


def test_sensitivity_quotes_the_runs_that_were_made() -> None:
    found = {
        JUDGED: {"hard": _record(180.0)}, SOFTER: {"hard": _record(160.0)},
        COARSE: {"hard": _record(175.0)}, CONVERGED: {"hard": _record(260.0)},
    }  # fmt: skip
    text = sensitivity(found, "hard", PEAK, 170.0)
    for words in ("160 N at 0.05, 180 N at 0.1", "0.071 would give", "4672 elements: 175 N at 0.1",
                  "step: 260 N"):  # fmt: skip
        assert words in text


def test_sensitivity_says_nothing_of_runs_that_failed() -> None:
    assert sensitivity({JUDGED: {"hard": _record(180.0)}}, "hard", PEAK, 170.0) == ""
    assert value_of({}, JUDGED, "hard", PEAK) is None
