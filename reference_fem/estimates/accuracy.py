"""Mesh and element that keep peak force, impulse, duration and arrival within a relative error.

The errors that a mesh leaves (`mesh_error`) go with (e/a)^3/2, e the edge at the contact and a the
patch's radius, and with the square of the shafts' edges over the diameter. Both sizes are those of
the soft finger's tap at 1 %, scaled to other accuracies by these powers.
"""

from dataclasses import dataclass

from meshes.bounds import Bound
from reference_fem.estimates.mesh_error import EDGE_EXPONENT
from reference_fem.settings import ONE_POINT

ACCURACY_QUANTITIES = (
    "peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s", "contact_time_s",
)  # fmt: skip
"""The numbers that an accuracy applies to, by the summary's fields."""
SMALLEST, LARGEST = 2e-3, 0.1
# A mesh that is 1 % off: e/a, and the shafts' cells over the diameter, as long along the axis (5/3
# as long they were too stiff in bending, the impulse 0.5 % off). Against meshes of 0.24 a and 0.08
# diameters the soft finger's peak, impulse and duration are 0.1, 0.1 and 0.0 % off, the hard one's
# 0.0, 0.0 and 0.4 %; meshes in between scatter by 1 %.
BASE_ACCURACY, EDGE, SECTION = 0.01, 0.4, 0.2
# Halving meets a wanted edge only within a factor of 2: 0.63 a left 5 % in the soft peak.
LARGEST_EDGE = 0.45
COARSEST = BASE_ACCURACY * (LARGEST_EDGE / EDGE) ** EDGE_EXPONENT
"""The accuracy above which all meshes have the same edge at the contact."""
# Ratio by which edges grow behind the patch, and how often cells are halved in place between the
# shafts' size and the patch's edge, instead of fine blocks throughout.
GROWTH, HALVINGS = 1.4, 3
# Relaxation time over a / c. A finger of nu = 0.49, mu = 1.14 had peaks of 11.1, 10.9 and 11.9 N at
# edges of 0.25, 0.18 and 0.14 a; with 0.03 a / c 10.80, 10.77 and 10.77 N, with 0.15 a / c 10.77,
# 10.74 and 10.75 N. Frictionless, 0.03 a / c lowers its peak by 0.2 %, its impulse by 0.01 %.
RELAXATION_SHARE = 0.02
# Distance from the touch, over a, within which elements have it: that is where it flutters. Peaks
# of four random fingers that flutter agree to 0.2 % with 1, 2, 3 and 4 a; the whole finger relaxing
# takes up to 0.5 % from a peak and 1 % from a stress at R, by its vibration.
RELAXATION_REACH = 2.0
# Friction from which on a relaxation time is set. It moved the peak or the impulse of 20 of 74
# random fingers with friction above 0.35 by over 1 % (at most 11 %); among the study's 21 with 0.15
# to 0.35 the peak of one by 5 % (0.24, nu = 0.485) and of three by 0.6 to 0.8 %; in 16 with less by
# 0.43 % at most, by 0.08 % in the median.
FLUTTER_FRICTION = 0.15
# Elements of one point moved the hard finger's peak and duration by 0.7 and 2 %.
ONE_POINT_FROM = 0.02


@dataclass(frozen=True)
class Sizes:
    """Mesh sizes, element and relaxation that an accuracy asks for.

    edge : edge length at the contact, over Hertz's radius
    section : size of the shafts' cells over the diameter, along the axis too
    element : in 3D; None is the default, the one-point element takes a third of its time
    relaxation : relaxation time of the material where the tip slides, over a / c
    """

    edge: float
    section: float
    element: str | None
    relaxation: float


def sizes_for(accuracy: float, friction: float = 0.0) -> Sizes:
    """Sizes that keep errors within `accuracy` for a tip that slides with that friction.

    Raises
    ------
    ValueError
        The accuracy is smaller than such meshes are known to keep, or too large.
    """
    if not Bound(at_least=SMALLEST, at_most=LARGEST).holds(accuracy):
        raise ValueError(
            f"accuracy = {accuracy!r}: must be {SMALLEST:g} to {LARGEST:g} for finite elements;"
            " below that refine a preset and compare (fingertap converge)"
        )
    return Sizes(
        edge=min(EDGE * (accuracy / BASE_ACCURACY) ** (1.0 / EDGE_EXPONENT), LARGEST_EDGE),
        section=SECTION * (accuracy / BASE_ACCURACY) ** 0.5,
        element=ONE_POINT if accuracy >= ONE_POINT_FROM else None,
        relaxation=RELAXATION_SHARE if friction >= FLUTTER_FRICTION else 0.0,
    )
