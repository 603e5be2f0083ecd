"""Errors of a tap's numbers by what its samples are: their deviations, scatter and places."""

import math
from dataclasses import dataclass

import numpy as np

from validation.harness.record import Floats

UNKNOWN = (np.inf, np.inf)  # of both ends
EQUAL = 3  # pairs of equal neighbours in rounded samples: exact ones have two at most, at a peak
COARSEST = 1 / 16  # of the peak: rounding in larger steps is taken for saturation
OTHER_RUNS = 5  # longest other runs of equal samples that a rounded top is as long as (`held`)
# Taps by Hertz's law have sharper tops than half sines. Those of soft by hcm-refined and, as a
# silicone, by fem3d, of soft made 2 m long and of two phalanges with e* = 0.7, with 8 to 40 samples
# wherever these lie, miss at most 1.33 times what the parabola through the three highest would, and
# at most 2.6 times the half sine's bound; what is sharper still is a stray sample (`lone_peak`).
SHARPER, SHARPEST = 1.4, 3.0
LARGEST_ALIKE = 0.99  # correlation of neighbours, beyond which a zero line drifts


@dataclass(frozen=True)
class ZeroLine:
    """A force where nothing touches, N.

    zero : its median, which edges of a tap hardly move. known : three standard deviations of that,
    or what counts as zero. scatter : one standard deviation of a sample, by the median of what
    samples are off. lasting : factor on the deviation of a mean of samples, by how alike neighbours
    are; 1 if independent.
    """

    zero: float
    known: float
    scatter: float
    lasting: float = 1.0

    @property
    def offset(self) -> float:
        """Magnitude of the median where it is one, else zero."""
        return abs(self.zero) if abs(self.zero) > self.known else 0.0


def zero_line(idle: Floats, least: float = 0.0) -> ZeroLine:
    """Of the samples where nothing touches; zero without one. An offset is more than `least`, N."""
    if not idle.size:
        return ZeroLine(0.0, least, 0.0)
    zero = float(np.median(idle))
    off = idle - zero
    scatter = 1.4826 * float(np.median(np.abs(off)))
    alike = float(off[1:] @ off[:-1]) / max(float(off @ off), 1e-300)  # of noise of order one
    lasting = math.sqrt((1.0 + alike) / (1.0 - alike)) if 0.0 < alike < LARGEST_ALIKE else 1.0
    known = 3.0 * 1.2533 * scatter * lasting / math.sqrt(idle.size)
    return ZeroLine(zero, max(known, least), scatter, lasting)


def quantum(force: Floats) -> float:
    """Step of samples that are rounded to one, N: the smallest difference of two values, if some
    neighbours are equal; 0 if they are not rounded so.
    """
    equal = (np.diff(force) == 0.0) & (force[1:] != 0.0)
    return float(np.diff(np.unique(force)).min()) if equal.sum() >= EQUAL else 0.0


def held(force: Floats) -> tuple[int, int]:
    """For how many samples on end a tap's force stays at its largest value, and how many may so.

    Up to n = 2 T/(pi dt) arccos(1 - r/F) + 5 m (about 2 T/(pi dt) sqrt(2 r/F) + 5 m) of samples dt
    apart are no saturation:

    - a half sine of duration T is within r of its top F for as long as the first term; r is the
      step of the samples (`quantum`), at most `COARSEST` F, for the rise to a plateau looks like a
      step, and T 3/2 of the time that the force stays above F/2 about there
    - m is the longest run of equal samples between F/2 and F, else below, such as a converter
      repeats; a parabola that is rounded stays a step below its top, on either side, for
      (sqrt(2) - 1)/2, more than a fifth, of the time at its top

    force : (n,), N, of the tap with a sample without force at both ends; 0, 0 if none is positive.
    """
    top = float(force.max())
    if top <= 0.0:
        return 0, 0
    edges = np.flatnonzero(np.diff(force)) + 1
    runs, values = np.diff(edges), force[edges[:-1]]
    longest = int(np.argmax(np.where(values == top, runs, 0)))
    below = [runs[(values > share * top) & (values < top)] for share in (0.5, 0.0)]
    other = int((below[0] if below[0].size else below[1]).max(initial=1))
    low = np.flatnonzero(force <= 0.5 * top)
    after = int(np.searchsorted(low, edges[longest]))
    high = force[low[after - 1] : low[after]]
    within = math.acos(1.0 - min(quantum(high) / top, COARSEST))
    return int(runs[longest]), int(3.0 / math.pi * high.size * within) + OTHER_RUNS * other


def lone_peak(size: Floats, allowed: float) -> float:
    """By how much the largest sample stands above both neighbours, N, if more than `allowed`.

    size : (n,), N, of the tap with zero at both ends
    """
    top = max(int(np.argmax(size)), 1)  # all may be zero
    above = float(size[top] - max(size[top - 1], size[top + 1]))
    return above if above > allowed else 0.0


def excess(force: Floats, scatter: float) -> float:
    """By what scatter may raise the largest of a tap's |samples|, N: with m of them within three
    times the scatter of it, (1 + sqrt(2 ln m)) scatter, which 19 of 20 half sines keep.
    """
    size = np.abs(force)
    near = int((size + 3.0 * scatter >= size.max()).sum())
    return scatter * (1.0 + math.sqrt(2.0 * math.log(near)))


def _edge(time: Floats, force: Floats) -> float:
    """What the trapezoids of a tap's first edge leave of its impulse, N s.

    With F_1, F_2, F_3 the first samples with force, dt apart, and D_i = F_{i+1} - F_i:
    dt max(F_1, D_1)/12, the sum of Euler and Maclaurin for a slope that goes on to zero, and what
    rises in one interval alone, dt/2 (max(F_1 - D_1, 0) + max(D_1 - 2 max(D_2, 0), 0)).

    time, force : (n,), s, N, from the last sample without force on
    """
    first, (second, third) = force[1], np.diff(force[1:4])
    jumps = max(first - second, 0.0) + max(second - 2.0 * max(third, 0.0), 0.0)
    return float((time[1] - time[0]) * (max(first, second) / 12.0 + 0.5 * jumps))


def _between(time: Floats, size: Floats, raised: float) -> tuple[float, float, float]:
    """What samples may miss of a half sine's peak, N, and of one as sharp as theirs; how far away
    it may lie, s.

    - A half sine of duration T whose top lies in an interval T/m between two samples is at most
      1/cos(pi/2/m) times as high as these. The interval is the longest beside a sample that is the
      largest within `raised`, N; T that of the samples with force and, if their number is odd, one
      interval more, as the top cannot lie midway then.
    - A parabola of curvature c is at most c dt^2/8 higher than the nearer of two samples dt apart.
      c is `SHARPER` times that of three samples, the middle one the largest within `raised`, at
      most `SHARPEST` times the half sine's.

    time, size : (n,), s and |N|, with a sample without force at both ends
    """
    steps, high = np.diff(time), size + raised >= size.max()
    longest = float(steps[high[1:] | high[:-1]].max())
    lasts = float(time[-2] - time[1]) + size.size % 2 * float(np.median(steps))
    if lasts <= longest * (1.0 + 1e-9):
        return math.inf, math.inf, longest
    half_sine = (1.0 / math.cos(0.5 * math.pi * longest / lasts) - 1.0) * float(size.max())
    curvature = -2.0 * np.diff(np.diff(size) / steps) / (steps[1:] + steps[:-1])
    sharpest = float(curvature[high[1:-1]].max(initial=0.0))
    parabola = SHARPER * sharpest * longest**2 / 8.0
    return half_sine, min(max(half_sine, parabola), SHARPEST * half_sine), longest


def peak_error(
    time: Floats, force: Floats, sigma: Floats, line: ZeroLine, step: float
) -> tuple[float, float]:
    """Error of the largest of a tap's |samples|, N, and how far away the peak may lie, s.

    sigma there, and what lies between samples (`_between`); what scatter (`excess`), rounding, the
    zero line and a stray sample (`lone_peak`) add. The force is as high elsewhere within sigma and
    scatter.
    """
    size = np.abs(force)
    top, raised = int(np.argmax(size)), excess(force, line.scatter)
    half_sine, missed, beside = _between(time, size, raised)
    high = np.abs(time[size + sigma + raised >= size[top]] - time[top]).max()
    raised += 0.5 * step
    # a half sine's neighbours are no more than four times as far below its largest sample
    usual = 4.0 * half_sine + 3.0 * (raised + float(np.median(np.abs(np.diff(size)))))
    raised += lone_peak(size, usual)
    error = float(np.hypot(sigma[top], missed)) + raised + line.offset
    return error, max(float(high), 0.5 * beside)


def normal_force_errors(
    time: Floats, normal: Floats, sigma: Floats, least: float, line: ZeroLine, step: float = 0.0
) -> dict[str, float]:
    """What one standard deviation, correlated all along a tap, and its samples mean for it.

    - peak and its time: `peak_error`
    - impulse: the integral of sigma; what trapezoids leave of a half sine of duration T, which is
      tan(x)/x - 1 of each, x = pi dt/(2 T), and `_edge` for steeper ones; scatter from sample to
      sample and the zero line
    - start, end: how long the force is no more than the threshold, sigma and twice the scatter
      (for a linear rise, these over the slope), and how long it is below the threshold, unseen: no
      longer than it then takes to three times that, linear or as Hertz's t^(3/2)

    time, normal, sigma : (n,), s and N, of the tap with a sample without force at both ends.
    least : up to it nothing touches, N. step : of rounded samples, N, which hide half of it.
    """
    least = max(least, 0.5 * step)
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
    steps = np.diff(time)
    lasts = float(time[-2] - time[1] + np.median(steps))
    x = 0.5 * np.pi * steps / lasts
    rule = np.inf
    if time.size > 4 and x.max() < 0.5 * np.pi:
        parts = 0.5 * steps * (normal[1:] + normal[:-1])
        half_sine = float((parts * (np.tan(x) / x - 1.0)).sum())
        rule = max(half_sine, _edge(time, normal) + _edge(-time[::-1], normal[::-1]))
    rule += least * unseen.sum()
    # a rounded top is flat, and up to half a step off as long as it is
    rule += 0.25 * step * float(steps[normal[1:] + step >= normal[top]].sum())
    scattered = line.scatter * line.lasting * math.sqrt(float((steps**2).sum()))
    peak, far = peak_error(time, normal, sigma, line, step)
    known = math.hypot(float(np.trapezoid(sigma, time)), rule, scattered)
    return {
        "contact_time_s": float(ends[0]),
        "contact_duration_s": float(sum(ends)),
        "peak_normal_force_N": peak,
        "peak_normal_force_time_s": far + float(ends[0]),
        "normal_impulse_N_s": known + line.offset * float(time[-1] - time[0]),
    }
