"""Interrupts: at any line of the loop, and in a rigid flight; what is kept belongs together."""

import sys
from collections import Counter
from types import FrameType
from typing import Any

import numpy as np
import pytest

import hcm
from hcm import stepping
from hcm.results.record import next_segment
from tests.hcm.cases import SOFT, SOFT_TIP, SURFACE, finger

Line = tuple[str, int]
VISIT = 3


def tapped(interrupted: Line | None, lines: Counter[Line]) -> hcm.TapResult:
    """A tap, interrupted at a line's third visit; `lines` counts those of the loop's Python."""
    codes = {stepping.take_steps.__code__, next_segment.__code__}

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        if frame.f_code not in codes:
            return None
        if event == "line":
            line = (frame.f_code.co_name, frame.f_lineno)
            lines[line] += 1
            if line == interrupted and lines[line] == VISIT:
                raise KeyboardInterrupt
        return trace

    sys.settrace(trace)
    try:
        return hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP)
    finally:
        sys.settrace(None)


def test_an_interrupt_at_any_line_keeps_whole_segments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stepping, "TABLE_ROWS", 40)
    lines: Counter[Line] = Counter()
    whole = tapped(None, lines)
    assert whole.status is hcm.Status.COMPLETED
    looped = [line for line, visits in lines.items() if visits >= VISIT]
    assert len(looped) > 20
    for line in looped:
        result = tapped(line, Counter())
        history = result.history
        rows = len(history.time_s)
        assert result.status is hcm.Status.INTERRUPTED, line
        assert rows in (41, 81, 121), line  # the first row, and segments of 40
        assert np.array_equal(history.time_s, whole.history.time_s[:rows]), line
        assert np.array_equal(history.hinge_reactions_N, whole.history.hinge_reactions_N[:rows]), (
            line
        )
        assert result.statistics.steps == rows - 1, line
        assert f"t = {history.time_s[-1]:.9g} s" in result.message, line
        assert len(result.events) == len(result.event_postures), line


def test_an_interrupted_rigid_flight_keeps_where_it_began(monkeypatch: pytest.MonkeyPatch) -> None:
    module = sys.modules["hcm.start"]
    land = module.start_after_flight

    def interrupted(*arguments: Any) -> None:
        land(*arguments)
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "start_after_flight", interrupted)
    start = hcm.RigidStart((0.1, 0.2, 0.3), (0.0, 1.0, 2.0), 0.01)
    settings = hcm.Settings(flight="rigid")
    result = hcm.simulate(finger(SOFT), SURFACE, SOFT_TIP, settings=settings, start=start)
    assert result.status is hcm.Status.INTERRUPTED
    assert result.history.time_s.tolist() == [0.01]
    assert result.statistics.steps == 0
    assert not result.events
    tip = -0.04 * np.array([np.cos(start.angles).sum(), np.sin(start.angles).sum()])
    assert result.history.tip_position_m[0] == pytest.approx(tip, rel=1e-12)
