"""The paper's ledger: verdicts against hand-made cases, and every claim has a finding."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from cyclopts import App

from validation.claims import read_claims
from validation.cli import app
from validation.paper.cases import (
    Case,
    driven_cases,
    experiments,
    torques,
    undriven_cases,
)
from validation.paper.finding import Finding, event_times, slips
from validation.paper.identify_torque import printed_arrivals
from validation.paper.ledger import (
    CLOSE,
    CONTRADICTS,
    NOT_REPRODUCED,
    REFERENCE_ROWS,
    REPRODUCED,
    judge,
    ledger,
    ledger_table,
    printed_rounding,
    score,
)
from validation.paper.stored_cases import CaseRun
from validation.record import Event, RunRecord
from validation.scenes.load import load_scene

CLAIMS = {claim.id: claim for claim in read_claims()}


def test_claims_are_those_of_the_article() -> None:
    assert len(CLAIMS) == 78
    assert {c.kind for c in CLAIMS.values()} == {
        "value", "count", "state", "curve", "approx", "bound"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "half_unit"), [("8.5", 0.05), ("173.084", 0.0005), ("30", 0.5), ("0.012", 0.0005)]
)
def test_rounding_is_half_the_last_printed_digit(text: str, half_unit: float) -> None:
    assert printed_rounding(text) == pytest.approx(half_unit)


@pytest.mark.parametrize(
    ("ours", "verdict"),
    [
        (173.084 * 1.009, REPRODUCED),
        (173.084 * 0.991, REPRODUCED),
        (173.084 * 1.011, CLOSE),
        (173.084 * 0.951, CLOSE),
        (173.084 * 1.051, NOT_REPRODUCED),
        (-173.084, NOT_REPRODUCED),
    ],
)
def test_values_are_judged_by_their_deviation(ours: float, verdict: str) -> None:
    row = judge(CLAIMS["T2.1"], Finding(ours))
    assert row.verdict == verdict
    assert row.deviation_percent == pytest.approx(100 * (ours / 173.084 - 1))


def test_a_value_inside_its_printed_rounding_is_reproduced() -> None:
    assert CLAIMS["F11.7"].value == "1.5"
    assert judge(CLAIMS["F11.7"], Finding(1.549)).verdict == REPRODUCED  # 3.3 % off
    assert judge(CLAIMS["F11.7"], Finding(1.56)).verdict == CLOSE


def test_counts_must_be_equal_and_states_true() -> None:
    assert judge(CLAIMS["F11.1"], Finding(4)).verdict == REPRODUCED
    assert judge(CLAIMS["F11.1"], Finding(5)).verdict == NOT_REPRODUCED
    assert judge(CLAIMS["F10.5"], Finding(True)).verdict == REPRODUCED
    assert judge(CLAIMS["F10.5"], Finding(False)).verdict == NOT_REPRODUCED


def test_a_missing_run_is_not_reproduced_and_a_contradiction_wins() -> None:
    assert judge(CLAIMS["T2.1"], Finding(None)).verdict == NOT_REPRODUCED
    row = judge(CLAIMS["F10.1"], Finding(7.2, "", "arithmetic"))
    assert row.verdict == CONTRADICTS
    assert "arithmetic" in row.reason


def test_reference_rows_say_which_model_judges_them() -> None:
    row = judge(CLAIMS["T2.5"], Finding(173.0))
    assert "other model: fem3d ls-dyna-like" in row.reason
    assert "self: hcm" in judge(CLAIMS["T2.1"], Finding(173.0)).reason


def test_no_claim_is_skipped() -> None:
    findings = {id_: Finding(None) for id_ in CLAIMS}
    rows = ledger(list(CLAIMS.values()), findings)
    assert [row.id for row in rows] == list(CLAIMS)
    del findings["F16.4"]
    with pytest.raises(KeyError, match=r"F16\.4"):
        ledger(list(CLAIMS.values()), findings)


def test_score_counts_the_reduced_models_rows_only() -> None:
    claims = [CLAIMS[i] for i in ("T2.1", "T2.5", "F12.1", "F10.1")]
    findings = {
        "T2.1": Finding(173.084), "T2.5": Finding(173.1), "F12.1": Finding(True),
        "F10.1": Finding(1.0, "", "arithmetic"),
    }  # fmt: skip
    assert "T2.5" in REFERENCE_ROWS
    assert score(ledger(claims, findings), claims) == (2, 2)


def test_table_has_the_columns_that_users_rely_on() -> None:
    rows = ledger([CLAIMS["F10.5"]], {"F10.5": Finding(True)})
    text = ledger_table(rows).to_csv(index=False)
    header, line = csv.reader(text.splitlines())
    assert header == [
        "id", "where", "scene", "quantity", "paper_value", "unit", "our_value",
        "deviation_percent", "verdict", "reason",
    ]  # fmt: skip
    assert line[6] == "true"


def test_every_case_is_a_valid_scene_with_a_name_of_its_own() -> None:
    cases = (*undriven_cases(), *experiments(), *driven_cases(7e-5, 1e-6))
    assert len({case.name for case in cases}) == len(cases)
    for case in cases:
        load_scene(case.scene, case.overrides)


def test_only_the_third_torque_is_scaled() -> None:
    scene = load_scene("driven-2", (torques("driven-2", 1e-4),))
    assert scene.tables.torques == pytest.approx((1.0, 0.8, 0.3))


def test_printed_arrival_times_come_from_the_claims() -> None:
    assert printed_arrivals() == {"driven-1": 0.0912, "driven-2": 0.01218, "driven-3": 0.0105}


def _run(velocity: list[float], mode: list[int]) -> CaseRun:
    time = np.linspace(1.0, 2.0, len(mode))
    record = RunRecord(
        "soft", "hcm", "", "COMPLETED", True, "",
        {"contact_time_s": 1.0, "contact_duration_s": 1.0},
        {"time_s": time, "mode": np.array(mode), "particle_velocity_m_per_s": np.array(velocity)},
        (Event(1.25, "stick_to_slip"), Event(2.5, "stick_to_slip")),
    )  # fmt: skip
    return CaseRun(Case("x", "soft"), record, (), ())


def test_slip_phases_are_read_in_order() -> None:
    # 5 is compression and slip, 4 compression and stick
    run = _run([1.0, 1.0, 0.0, -1.0, -1.0, 0.0, 2.0, -2.0], [5, 5, 4, 5, 5, 4, 5, 5])
    assert slips(run) == [1, -1, 1, -1]


def test_events_after_the_first_tap_do_not_count() -> None:
    run = _run([0.0, 0.0], [4, 4])
    assert event_times(run, "stick_to_slip") == [0.25]
    endless = replace(run, record=run.record.with_summary(contact_duration_s=None))
    assert event_times(endless, "stick_to_slip") == [0.25, 1.5]


def test_the_command_is_there() -> None:
    assert isinstance(app["paper"], App)
