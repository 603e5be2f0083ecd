"""One step of Dormand and Prince's Runge-Kutta pair, order 5 with an embedded 4.

Hairer, Norsett and Wanner (1993), Solving Ordinary Differential Equations I, table II.5.2. The last
stage is the next step's first.
"""

import numpy as np

from hcm.arrays import Floats
from hcm.compiled import kernel
from hcm.flight.rigid_chain import Rods, rates

STAGES = 7
A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
C = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
# differences between the two orders' weights
E = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


@kernel
def dormand_prince(
    time: float, h: float, state: Floats, stages: Floats, rods: Rods, new: Floats
) -> float:
    """Step `state` (2 P,) at `time`, s, by h into `new`; returns the error estimate, m.

    stages : (7, 2 P), the first one of `state`, overwritten from the second on. The error is that
    of the rods' ends, plus that of their rates over one step.
    """
    for s in range(1, STAGES):
        for i in range(state.size):
            slope = 0.0
            for j in range(s):
                slope += A[s, j] * stages[j, i]
            new[i] = state[i] + h * slope
        rates(time + C[s] * h, new, rods, stages[s])
    error, n = 0.0, rods.length.size
    for i in range(state.size):
        off = 0.0
        for s in range(STAGES):
            off += E[s] * stages[s, i]
        error += abs(h * off) * (rods.length[i] if i < n else h * rods.length[i - n])
    return error
