"""Point masses whose stick and slip can be written down: an independent event-by-event solution.

Every phase is x = p + c t + a t^2/2 + A cos(w t) + B sin(w t) with its own constants; event times
are roots of those formulas, bracketed on a fine grid. No code of the package is used.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq


def first_root(g: Callable[[float], float], end: float, rising: bool = False) -> float:
    """First time in (0, end] at which g falls (or rises) through zero, or infinity."""
    grid = end * np.linspace(0, 1, 4001)[1:]
    sign = -1.0 if rising else 1.0
    values = sign * np.array([g(t) for t in grid])
    for i in range(1, grid.size):
        if values[i - 1] > 0 >= values[i]:
            return brentq(g, grid[i - 1], grid[i], xtol=1e-18, rtol=1e-15)
    return np.inf


@dataclass
class Outcome:
    """(time, kind) of the events and the velocity at the end."""

    events: list[tuple[float, str]]
    velocity: tuple[float, float]


def oblique_impact(
    mass: float, k: float, e: float, ratio: float, mu: float, vt: float, vn: float
) -> Outcome:
    """Stronge's bilinear normal element with tangential compliance k_t = ratio k, point mass.

    Normal: F = |vn| sqrt(m k) sin(w t) up to t_1 = pi/(2 w), then the same maximum times
    cos(w (t - t_1)/e), until t_1 (1 + e). Tangential: stick m x.. = -k_t (x - P), slip
    m x.. = -s mu F.
    """
    w, kt = np.sqrt(k / mass), ratio * k
    turn, end = np.pi / (2 * w), np.pi / (2 * w) * (1 + e)
    peak = abs(vn) * np.sqrt(mass * k)

    def force(t: float) -> float:
        return peak * np.sin(w * t) if t < turn else peak * np.cos(w * (t - turn) / e)

    def rate(t: float) -> float:
        return peak * w * np.cos(w * t) if t < turn else -peak * w / e * np.sin(w * (t - turn) / e)

    def impulse(t: float) -> float:
        if t < turn:
            return peak / w * (1 - np.cos(w * t))
        return peak / w * (1 + e * np.sin(w * (t - turn) / e))

    events = [(0.0, "contact"), (turn, "compression_to_restitution")]
    now, u, v = 0.0, 0.0, vt  # time, spring extension, tip velocity
    sticking = abs(vt / vn) < mu / ratio
    s = np.sign(vt)
    wt = np.sqrt(kt / mass)
    while True:
        t0, u0, v0 = now, u, v
        if sticking:

            def extension(t: float, t0=t0, u0=u0, v0=v0) -> float:
                return u0 * np.cos(wt * (t - t0)) + v0 / wt * np.sin(wt * (t - t0))

            def room(d: float, t0=t0, extension=extension) -> float:
                return mu * force(t0 + d) - kt * abs(extension(t0 + d))

            found = t0 + first_root(room, end - t0)
            stop = min(found, end)
            u = extension(stop)
            v = -u0 * wt * np.sin(wt * (stop - t0)) + v0 * np.cos(wt * (stop - t0))
            if found < end - 1e-9 * end:
                events.append((found, "stick_to_slip"))
                s = np.sign(u)
        else:

            def velocity(t: float, t0=t0, v0=v0, s=s) -> float:
                return v0 - s * mu * (impulse(t) - impulse(t0)) / mass

            def slide(d: float, t0=t0, s=s, velocity=velocity) -> float:
                return s * (velocity(t0 + d) - s * mu * rate(t0 + d) / kt)

            found = t0 + first_root(slide, end - t0)
            stop = min(found, end)
            v, u = velocity(stop), s * mu * force(stop) / kt
            if found < end - 1e-9 * end:
                events.append((found, "slip_to_stick"))
        if found >= end - 1e-9 * end:
            break
        sticking, now = not sticking, found
    events.append((end, "separation"))
    return Outcome(sorted(events), (v, -e * vn))


def block_on_belt(
    mass: float, spring: float, kt: float, grip: float, belt: float, speed_0: float, end: float
) -> Outcome:
    """Block on a belt, held by a spring, pressed on it by a constant force.

    The belt's own frame: the anchor moves at -belt, x is the block's position, its contact has the
    stiffness kt and slips at `grip` = mu N. Starts with the spring unstretched and the block
    slipping ahead of the belt at speed_0 > 0.
    """
    events: list[tuple[float, str]] = []
    now, x, v, particle, sticking, s = 0.0, 0.0, speed_0, 0.0, False, 1.0
    while True:
        t0, x0, v0 = now, x, v
        stiff = spring + (kt if sticking else 0.0)
        w = np.sqrt(stiff / mass)
        # m x.. + stiff x = kt P (stick) or -s grip (slip), minus spring belt t
        constant = (kt * particle if sticking else -s * grip) / stiff
        drift = -spring * belt / stiff
        a, b = x0 - constant - drift * t0, (v0 - drift) / w

        def place(t: float, c=constant, d=drift, a=a, b=b, w=w, t0=t0) -> float:
            return c + d * t + a * np.cos(w * (t - t0)) + b * np.sin(w * (t - t0))

        def speed(t: float, d=drift, a=a, b=b, w=w, t0=t0) -> float:
            return d + w * (b * np.cos(w * (t - t0)) - a * np.sin(w * (t - t0)))

        def left(d: float, t0=t0, stick=sticking, p=particle, s=s, x=place, v=speed) -> float:
            return grip - kt * abs(x(t0 + d) - p) if stick else s * v(t0 + d)

        found = t0 + first_root(left, end - t0)
        if found >= end:
            return Outcome(events, (speed(end), 0.0))
        x, v = place(found), speed(found)
        if sticking:
            events.append((found, "stick_to_slip"))
            s = np.sign(x - particle)
        else:
            events.append((found, "slip_to_stick"))
            particle = x - grip / kt * s
        sticking, now = not sticking, found
