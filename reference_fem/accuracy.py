"""Mesh and element that keep a relative error of peak force, impulse, duration and arrival.

The errors that a mesh leaves (`mesh_error`) go with the edge e where it touches over the patch's
radius a, to the power 3/2, and with the square of the shafts' edges over the diameter: both at
their share of the soft finger's tap at 1 %, and from there by their powers.
"""

from dataclasses import dataclass

from reference_fem.mesh_error import EDGE_EXPONENT

ACCURACY_QUANTITIES = (
    "peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s", "contact_time_s",
)  # fmt: skip
"""What an accuracy is about, by the summary's fields."""
SMALLEST, LARGEST = 2e-3, 0.1
# Of a mesh that is 1 % off: e/a and shafts' cells over the diameter, as long along the axis: cells
# of 5/3 were 0.5 % off in the impulse, too stiff in bending. Next to meshes of 0.24 a and 0.08
# diameters the soft finger's peak, impulse and duration are 0.1, 0.1 and 0.0 % off, the hard one's
# 0.0, 0.0 and 0.4 %; meshes between scatter by 1 %.
BASE_ACCURACY, EDGE, SECTION = 0.01, 0.4, 0.2
# Halved cells lie within a factor of 2 of what is asked: 0.63 a left 5 % in the soft peak.
LARGEST_EDGE = 0.45
COARSEST = BASE_ACCURACY * (LARGEST_EDGE / EDGE) ** EDGE_EXPONENT
"""The accuracy from which on meshes have like edges where it touches."""
GROWTH = 1.4
# Cells halved in place on the way to the fine ones, in the place of blocks as fine throughout.
HALVINGS = 3
# Relaxation time over a / c. A finger of nu = 0.49, mu = 1.14 had peaks of 11.1, 10.9 and 11.9 N at
# edges of 0.25, 0.18 and 0.14 a; with 0.03 a / c 10.80, 10.77 and 10.77 N, with 0.15 a / c 10.77,
# 10.74 and 10.75 N. Frictionless, 0.03 a / c lowers its peak by 0.2 %, its impulse by 0.01 %.
RELAXATION_SHARE = 0.02
# Friction from which on a tip relaxes. Relaxing moved the peak or the impulse of 20 of 74 random
# fingers with more than 0.35 by over 1 % (the most 11 %); of the study's 21 with 0.15 to 0.35 the
# peak of one by 5 % (0.24, nu = 0.485), of three by 0.6 to 0.8 %; of 16 with less by 0.43 % at
# most, 0.08 in median.
FLUTTER_FRICTION = 0.15
# Elements of one point moved the hard finger's peak and duration by 0.7 and 2 %.
ONE_POINT, ONE_POINT_FROM = "hex8-one-point", 0.02


@dataclass(frozen=True)
class Sizes:
    """What an accuracy asks for.

    edge : where it touches, over Hertz's radius
    section : size of the shafts' cells over the diameter, along the axis too
    growth : of the edges behind the patch
    halvings : how often cells are halved in place between the shafts' size and that edge
    element : in 3D; None is the default, one of one point takes a third of its time
    relaxation : relaxation time of the material where the tip slides, over a / c
    """

    edge: float
    section: float
    growth: float
    halvings: int
    element: str | None
    relaxation: float


def sizes_for(accuracy: float, friction: float = 0.0) -> Sizes:
    """Sizes whose errors stay within `accuracy` of a tip that slides with that friction.

    Raises
    ------
    ValueError
        The accuracy is smaller than such meshes are known to keep, or too large.
    """
    if not SMALLEST <= accuracy <= LARGEST:
        raise ValueError(
            f"accuracy = {accuracy:g}: must be {SMALLEST:g} to {LARGEST:g} for finite elements;"
            " below it refine a preset and compare (fingertap converge)"
        )
    return Sizes(
        edge=min(EDGE * (accuracy / BASE_ACCURACY) ** (1.0 / EDGE_EXPONENT), LARGEST_EDGE),
        section=SECTION * (accuracy / BASE_ACCURACY) ** 0.5,
        growth=GROWTH,
        halvings=HALVINGS,
        element=ONE_POINT if accuracy >= ONE_POINT_FROM else None,
        relaxation=RELAXATION_SHARE if friction >= FLUTTER_FRICTION else 0.0,
    )
