"""Findings of figs. 10, 12 and 14 from runs whose answers are known."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import pyplot as plt

from tests.validation.commands import Make, Patch
from validation.compare.claims import read_claims
from validation.harness.record import Event
from validation.studies.paper import cases, driven_findings, figures, readings
from validation.studies.paper.case_runs import Case, CaseRun
from validation.studies.paper.soft_findings import RESTITUTION, K, friction_findings, loop_closure

CLAIMS = read_claims()
START, LASTS = 0.136, 2e-4  # of `make_record`, s
MUS = (0.3, 0.5, 0.7, 0.9, 1.1, 1.3)
# Peaks by mu: of Fn, N, and of the stress, MPa; Ft is mu Fn.
NORMAL = dict(zip(MUS, (100.0, 93.0, 88.0, 80.0, 79.0, 79.0), strict=True))
STRESS = dict(zip(MUS, (2.0, 2.3, 2.5, 3.0, 3.01, 3.02), strict=True))


def _run(make: Make, mu: float) -> CaseRun:
    """It slides up to mu = 0.7; beyond, it slips before (0.9) or after its compression ends."""
    mode = 5 if mu <= 0.7 else 4
    slip, turn = (0.4 if mu < 1.0 else 0.6), 0.5
    record = make(peak=NORMAL[mu]).with_summary(peak_tangential_force_N=-mu * NORMAL[mu])
    history = record.history
    shape = history["normal_force_N"] / NORMAL[mu]
    history |= {"stress_R_Pa": 1e6 * STRESS[mu] * shape, "mode": np.full(shape.size, mode)}
    events = (Event(START + slip * LASTS, "stick_to_slip"),
              Event(START + turn * LASTS, "compression_to_restitution"))  # fmt: skip
    return CaseRun(Case(cases.friction_case(mu), "soft"), replace(record, events=events), (), ())


def test_frictions_findings_are_signed_as_their_claims(make_record: Make) -> None:
    """Decreases of Fn and increases of Ft and of the stress are all positive."""
    runs = {}
    for mu in MUS:
        for varied in ("", *cases.STIFFNESSES, *cases.STRESS_VARIED):
            runs[f"{cases.friction_case(mu)} {varied}".strip()] = _run(make_record, mu)
    found = friction_findings(runs)
    changes = {
        "F10.1": 7.0, "F10.2": 12.0, "F10.3": 100 * (0.5 * 93 / 30 - 1),
        "F10.4": 100 * (0.7 * 88 / 30 - 1), "F10.10": 15.0, "F10.11": 25.0,
    }  # fmt: skip
    for id_, change in changes.items():
        assert found[id_].value == pytest.approx(change)
    states = {"F10.5", "F10.6", "F10.7", "F10.8", "F10.9", "F10.12"}
    assert [id_ for id_ in states if found[id_].value is not True] == []
    # by the notes of the claims: +55.6 % and +105.3 % of Ft mean -6.6 and -12.0 % of Fn
    assert "means -6.6 % of Fn, not -7.2 %" in found["F10.1"].contradiction
    assert "means -12.0 % of Fn, not -11.6 %" in found["F10.2"].contradiction


def test_a_loop_of_the_law_closes(make_record: Make) -> None:
    """Compressed by u along k, it comes back along k/e*^2: (1 - e*^2) u is left."""
    depth = 1e-4
    down = np.linspace(0.0, depth, 50)
    back = np.linspace(depth, (1 - RESTITUTION**2) * depth, 50)[1:]
    force = np.concatenate([K * down, K / RESTITUTION**2 * (back - back[-1])])
    time = START + LASTS * np.linspace(0.0, 1.0, force.size)
    position = np.column_stack([time, -np.concatenate([down, back])])
    events = (Event(float(time[49]), "compression_to_restitution"),)
    record = replace(make_record(), events=events, history={
        "time_s": time, "normal_force_N": force, "tip_position_m": position,
    })  # fmt: skip
    case = Case("soft e*=0.8", "soft")
    assert abs(loop_closure(CaseRun(case, record, (), ()))) < 1e-9


@pytest.mark.parametrize(
    ("least", "word"), [(8.54, "inside"), (8.56, "outside"), (8.3, "inside"), (8.2, "outside")]
)
def test_a_print_lies_inside_a_band_that_reaches_its_rounding(
    least: float, word: str, monkeypatch: Patch
) -> None:
    """8.5 is printed for 8.45 to 8.55: the band is 0.16 wide, its ends in either order."""
    assert CLAIMS["F14.1"].paper_value == "8.5"
    values = {" low": least + 0.16, "": least + 0.1, " high": least}
    reading = {"F14.1": lambda runs, suffix: values[suffix]}
    monkeypatch.setattr(driven_findings, "READINGS", reading)
    assert driven_findings._band({}, CLAIMS["F14.1"]).endswith(f" {word}")


def test_of_the_postures_those_of_ripples_are_not_drawn(make_record: Make) -> None:
    """Contact, the one peak of Fn, and the end: what is bent most in between is no reversal."""
    record = make_record()
    postures = [
        SimpleNamespace(time_s=START + at * LASTS, deflection=lambda _, y=y: ([0.0], [y]))
        for at, y in ((0.0, 1.0), (0.3, -9.0), (0.5, -4.0), (1.0, 2.0))
    ]
    run = CaseRun(Case("soft", "soft"), record, postures, ())
    assert readings.drawn_postures(run) == [postures[0], *postures[2:]]
    assert readings.drawn_deflection(run) == 4.0
    assert readings.largest_deflection(run) == 9.0


def test_figure_9_names_the_models_that_it_has(make_record: Make, monkeypatch: Patch) -> None:
    monkeypatch.setattr(figures, "FIGURES", {})
    monkeypatch.setattr(figures, "overlay_figure", lambda *_: None)
    runs = {scene: _run(make_record, 0.5) for scene in figures.SCENES}
    captions = [
        figures.draw_figures(Path(), runs, references)[0][1]
        for references in ({}, {"soft": make_record(model="fem3d")})
    ]
    assert ["against" in caption for caption in captions] == [False, True]


@pytest.mark.usefixtures("figures_kept")
def test_forces_are_drawn_in_newtons_stresses_in_megapascals_over_ms(make_record: Make) -> None:
    run = _run(make_record, 0.5)
    _, (forces, stress) = plt.subplots(1, 2)
    figures.draw_forces_and_stress(forces, stress, {"soft": run}, [("soft", "0.5")], "ab")
    normal, tangential, *_ = forces.lines
    assert (normal.get_linestyle(), tangential.get_linestyle()) == ("-", "--")
    for line, peak in ((normal, 93.0), (stress.lines[0], 2.3)):
        assert line.get_ydata().max() == pytest.approx(peak)
        assert line.get_xdata()[line.get_ydata().argmax()] == pytest.approx(0.1)  # half of 0.2 ms
    assert tangential.get_ydata().min() == pytest.approx(-0.5 * 93.0)
