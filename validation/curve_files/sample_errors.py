"""Errors of a tap's numbers by what its samples are: their deviations, scatter and places."""

import math
from dataclasses import dataclass

import numpy as np

from validation.curve_files.samples import Floats

UNKNOWN = (np.inf, np.inf)  # of both ends


@dataclass(frozen=True)
class ZeroLine:
    """A force where nothing touches, N.

    zero : its median, which edges of a tap hardly move. known : three standard deviations of that.
    scatter : one standard deviation of a sample, by the median of what samples are off.
    """

    zero: float
    known: float
    scatter: float

    @property
    def offset(self) -> float:
        """Magnitude of the median where it is one, else zero."""
        return abs(self.zero) if abs(self.zero) > self.known else 0.0


def zero_line(idle: Floats) -> ZeroLine:
    """Of the samples where nothing touches; zero without one."""
    if not idle.size:
        return ZeroLine(0.0, 0.0, 0.0)
    zero = float(np.median(idle))
    scatter = 1.4826 * float(np.median(np.abs(idle - zero)))
    return ZeroLine(zero, 3.0 * 1.2533 * scatter / math.sqrt(idle.size), scatter)


def excess(force: Floats, scatter: float) -> float:
    """By what scatter may raise the largest of a tap's |samples|, N: with m of them within three
    times the scatter of it, (1 + sqrt(2 ln m)) scatter, which 19 of 20 half sines keep.
    """
    size = np.abs(force)
    near = int((size + 3.0 * scatter >= size.max()).sum())
    return scatter * (1.0 + math.sqrt(2.0 * math.log(near)))


def normal_force_errors(
    time: Floats, normal: Floats, sigma: Floats, least: float, line: ZeroLine
) -> dict[str, float]:
    """What one standard deviation, correlated all along a tap, and its samples mean for it.

    - peak: sigma there, what n samples of a half sine may miss of it, which are no further apart
      than T/m, m = n - 1 of even n and n of odd: 1/cos(pi/2/m) - 1; what scatter adds (`excess`)
      and the zero line; its time: how far away the force is as high within sigma and scatter
    - impulse: the integral of sigma, the trapezoid's (pi/n)^2/12, scatter from sample to sample
      and the zero line
    - start, end: how long the force is no more than the threshold, sigma and twice the scatter
      (for a linear rise, these over the slope), and how long it is below the threshold, unseen: no
      longer than it then takes to three times that, linear or as Hertz's t^(3/2)

    time, normal, sigma : (n,), s and N, of the tap with a sample without force at both ends.
    least : up to it nothing touches, N.
    """
    top, off = int(np.argmax(normal)), sigma + 2.0 * line.scatter
    seen = np.flatnonzero(normal > least + off)
    ends = np.array((time[seen[0]] - time[0], time[-1] - time[seen[-1]]) if seen.size else UNKNOWN)
    unseen = np.zeros(2)
    if least > 0.0:
        well = np.flatnonzero(normal > 3.0 * least + off)
        unseen = np.array(
            (time[well[0]] - time[1], time[-2] - time[well[-1]]) if well.size else UNKNOWN
        )
    ends = ends + unseen
    raised = excess(normal, line.scatter)
    high = np.abs(time[normal + sigma + raised >= normal[top]] - time[top]).max()
    samples = time.size - 2
    parts = samples - 1 + samples % 2
    missed = (1.0 / np.cos(0.5 * np.pi / parts) - 1.0) * normal[top] if parts > 1 else np.inf
    rule = (np.pi / samples) ** 2 / 12.0 * np.trapezoid(normal, time) if parts > 1 else np.inf
    rule += least * unseen.sum()
    scattered = line.scatter * math.sqrt(float((np.diff(time) ** 2).sum()))
    known = math.hypot(float(np.trapezoid(sigma, time)), rule, scattered)
    return {
        "contact_time_s": float(ends[0]),
        "contact_duration_s": float(sum(ends)),
        "peak_normal_force_N": float(np.hypot(sigma[top], missed)) + raised + line.offset,
        "peak_normal_force_time_s": float(high + ends[0]),
        "normal_impulse_N_s": known + line.offset * float(time[-1] - time[0]),
    }
