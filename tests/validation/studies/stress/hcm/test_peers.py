"""Other solvers on the reduced model's hard cells."""

import time

from validation.studies.stress.hcm import peers


def _slow(seconds: float) -> peers.PeerAnswer:
    time.sleep(seconds)
    return "completed", None, seconds


def test_a_peer_that_gives_no_answer_is_ended() -> None:
    began = time.monotonic()
    assert peers.limited(60.0, _slow, 0.01) == ("completed", None, 0.01)
    assert peers.limited(3.0, _slow, 120.0) == ("no answer after 3 s", None, 3.0)
    assert time.monotonic() - began < 60.0
