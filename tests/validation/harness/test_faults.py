"""A little of the faults campaign (`tests/faults/campaign.py`), which takes minutes."""

import random

import pytest

from tests.faults import damage, signals
from tests.faults.bench import Bench
from tests.faults.commands import RUN, complete
from tests.faults.results import collect, differences


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(tmp_path_factory.mktemp("faults"), random.Random(7))


def test_interrupts_and_kills_lose_nothing(bench: Bench) -> None:
    tally = signals.signals(bench, RUN, 2, 1.0, each=True)
    assert (tally.injected, tally.lost) == (2, [])


def test_the_campaign_sees_a_loss(bench: Bench) -> None:
    out = bench.fresh()
    assert complete(RUN, out).code == 0
    before = collect(out)
    assert differences(before, bench.undisturbed(RUN)) == []
    history = out / "run" / "soft-hcm" / "history.nc"
    damage.damage(history, random.Random(1))  # cut short: HDF5 does not open it at all
    assert differences(collect(out), before) == ["run/soft-hcm/history.nc"]
    history.unlink()
    assert differences(collect(out), before) == ["run/soft-hcm/history.nc"]
