from pathlib import Path

import numpy as np

from tests.validation.commands import Make
from validation.harness.store import Store
from validation.studies.paper.case_runs import Case, CaseRun, keep_case, load_case


def test_a_case_comes_back_with_its_postures(make_record: Make, tmp_path: Path) -> None:
    from hcm.results.posture import Postures

    # two phalanges of an element each
    q, v = np.random.default_rng(0).normal(size=(2, 2, 16))
    moving, shapes = (Postures((0.1, 0.2), ((0, 8), (8, 16)), q, rates) for rates in (v, None))
    case = Case("soft mu=0.7", "soft", ("surface.friction=0.7",), (0.1, 0.2))
    store = Store(tmp_path)
    assert load_case(store, case) is None
    keep_case(store, CaseRun(case, make_record(), moving, shapes))
    found = load_case(store, case)
    assert found.record.variant == case.name
    assert "friction = 0.7" in found.record.provenance["scene_toml"]
    for one, two in zip((*moving, *shapes), (*found.event_postures, *found.frames), strict=True):
        assert one.time_s == two.time_s
        for name in ("positions_m", "slopes", "velocities_m_per_s", "slope_rates_per_s"):
            for a, b in zip(getattr(one, name), getattr(two, name), strict=True):
                assert a.tobytes() == b.tobytes()
    assert load_case(store, Case("soft", "soft", (), (0.1, 0.2))) is None
    flight = Case("driven-1 flight", "driven-1", ("solver.hcm.max_contact_time=1e-9",))
    for status, kept in (("INTERRUPTED", False), ("STILL_IN_CONTACT", True)):
        keep_case(store, CaseRun(flight, make_record(ok=False, status=status), moving, shapes))
        assert (load_case(store, flight) is not None) == kept
    assert load_case(store, Case(case.name, "soft", case.overrides, (0.1,))) is None
