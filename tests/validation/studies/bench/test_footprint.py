"""Memory of arrays: each counts once, views with what they look into."""

from dataclasses import dataclass

import numpy as np

from validation.studies.bench.kernels import array_bytes


@dataclass(frozen=True)
class Held:
    whole: np.ndarray
    part: np.ndarray
    deeper: tuple[dict[str, np.ndarray], float]


def test_every_array_counts_once() -> None:
    whole = np.zeros(1000)
    other = np.zeros(10, dtype=np.int32)
    held = Held(whole, whole[10:20], ({"a": other, "b": whole}, 1.0))
    assert array_bytes(held, other, held) == 8000 + 40
    assert array_bytes(3.0, "text") == 0
    assert array_bytes(whole[5:6]) == 8000
