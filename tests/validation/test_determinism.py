"""Same scene, same machine, same bits: the reduced model at any number of threads, the reference
at any fixed number. Each run is a process of its own, as a user's is."""

import hashlib

from tests.processes import printed

CODE = """
import hashlib, sys
import numpy as np
from validation.runs.execute import solve
from validation.harness.record import plain
from validation.scenes.load import load_scene
model, *overrides = sys.argv[1:]
record = solve(load_scene("soft", overrides), model, None).record
digest = hashlib.sha256()
for name, array in sorted(record.history.items()):
    digest.update(name.encode() + np.ascontiguousarray(array).tobytes())
day = ("wall_time_s", "peak_memory_MB")
kept = {k: v for k, v in plain(record.summary).items() if k not in day}
digest.update(repr((sorted(kept.items()), record.events)).encode())
print(digest.hexdigest())
"""


def bits(threads: int, model: str, *overrides: str) -> str:
    names = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    more = {"OMP_WAIT_POLICY": "passive", "PYTHONHASHSEED": "random"}
    environment = dict.fromkeys(names, str(threads)) | more
    (line,) = printed("-c", CODE, model, *overrides, env=environment).split()
    assert len(line) == len(hashlib.sha256().hexdigest())
    return line


def test_reduced_model_gives_the_same_bits_at_any_number_of_threads() -> None:
    driven = ("drive.torques=[0.01, 0.008, 0.002]", "finger.elements=5")
    one = bits(1, "hcm", *driven)
    assert bits(2, "hcm", *driven) == one
    assert bits(1, "hcm", "finger.elements=5") != one  # the digest sees the scene


def test_reference_gives_the_same_bits_at_a_fixed_number_of_threads() -> None:
    for threads in (1, 2):
        scene = ("surface.height=0.06", f"solver.fem.threads={threads}")
        assert bits(threads, "fem2d", *scene) == bits(threads, "fem2d", *scene)
