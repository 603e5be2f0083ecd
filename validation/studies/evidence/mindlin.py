"""An elastic ball that hits a like body obliquely: Maw, Barber and Fawcett's theory (1976).

Hertz's pressure and Mindlin's tractions without coupling (Dundurs' constant is zero: like bodies,
or nu = 1/2 on a rigid wall), on a ball that is rigid except for its patch. By the method of
dimensionality reduction, exact for these assumptions (Popov and Hess 2015, ch. 5), with springs at
distances r of stiffness E* and G* per length, G*/E* = 2 (1 - nu)/(2 - nu),

    m d.. = -F_n,   m s.. = -(1 + m R^2/J) F_t,   F_n = 4/3 E* sqrt(R) d^(3/2),
    F_t = 2 G* int u dr,   u. = s. where |u| < mu (E*/G*) (d - r^2/R).

It is dimensionless: only x = v_t/(mu v_n) and the spin y = R w'/(mu v_n) remain.
"""

import math

import numpy as np

SPRINGS, STEPS = 800, 6000  # half of either changes y by 1e-3 at most
FRICTION, SPEED = 0.3, 1e-3  # without effect on y(x)


def spin(x: float, poisson: float, inertia: float = 0.4) -> float:
    """Spin y of a ball that does not turn when it touches; `inertia` : J/(m R^2)."""
    ratio = 2.0 * (1.0 - poisson) / (2.0 - poisson)
    deepest = (15.0 / 16.0 * SPEED**2) ** 0.4
    step = 2.9432 * deepest / SPEED / STEPS
    place = math.sqrt(1.001 * deepest) * (np.arange(SPRINGS) + 0.5) / SPRINGS
    width = place[1] - place[0]
    drawn, depth, approach, slide = np.zeros(SPRINGS), 0.0, SPEED, x * FRICTION * SPEED
    across = impulse = 0.0
    while True:  # velocity Verlet, R = m = E* = 1
        approach -= 0.5 * step * 4.0 / 3.0 * depth**1.5
        slide -= 0.5 * step * (1.0 + 1.0 / inertia) * across
        depth += step * approach
        if depth <= 0.0:
            return impulse / (inertia * FRICTION * SPEED)
        limit = FRICTION / ratio * np.maximum(depth - place**2, 0.0)
        drawn = np.clip(drawn + step * slide, -limit, limit)
        across = 2.0 * ratio * width * float(drawn.sum())
        approach -= 0.5 * step * 4.0 / 3.0 * depth**1.5
        slide -= 0.5 * step * (1.0 + 1.0 / inertia) * across
        impulse += step * across
