"""Mesh and element that keep a relative error of peak force, impulse, duration and arrival.

The errors that a mesh leaves (`mesh_error`) go with the edge e where it touches over the patch's
radius a, to the power 3/2, and with the square of the shafts' edges over the diameter: both at
their share of the soft finger's tap at 1 %, and from there by their powers.
"""

from dataclasses import dataclass

from reference_fem.mesh_error import POWER

HELD = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s", "contact_time_s")
"""What an accuracy is about, by the summary's fields."""
SMALLEST, LARGEST = 2e-3, 0.1
# Of a mesh that is 1 % off: e/a, shafts' cells over the diameter, and how much longer along the
# axis. On the soft finger 0.9, 0.0, 0.4 and 0.1 % in peak, impulse, duration and arrival (331,000
# elements), on the hard one 0.8, 0.6, 1.2 and 0.1 % (known to 1 %): meshes scatter by that.
AT, EDGE, SECTION, ALONG = 0.01, 0.4, 0.2, 5.0 / 3.0
# Growth of the edges behind the patch, where an error of 1 % is allowed, and below.
GROWTH, CAREFUL_GROWTH = 1.6, 1.4
# Elements of one point moved the hard finger's peak and duration by 0.7 and 2 %.
ONE_POINT, ONE_POINT_FROM = "hex8-one-point", 0.02


@dataclass(frozen=True)
class Sizes:
    """What an accuracy asks for.

    edge : where it touches, over Hertz's radius
    section : size of the shafts' cells over the diameter
    axial : the same along the axis
    growth : of the edges behind the patch
    element : of 3D; None the default, one point a third of its time
    """

    edge: float
    section: float
    axial: float
    growth: float
    element: str | None


def sizes_for(accuracy: float) -> Sizes:
    """Sizes whose errors stay within `accuracy`.

    Raises
    ------
    ValueError
        It is smaller than such a mesh is known to keep, or too large.
    """
    if not SMALLEST <= accuracy <= LARGEST:
        raise ValueError(
            f"accuracy = {accuracy:g}: must be {SMALLEST:g} to {LARGEST:g} for finite elements;"
            " below it refine a preset and compare (fingertap converge)"
        )
    section = SECTION * (accuracy / AT) ** 0.5
    return Sizes(
        edge=EDGE * (accuracy / AT) ** (1.0 / POWER),
        section=section,
        axial=ALONG * section,
        growth=GROWTH if accuracy >= AT else CAREFUL_GROWTH,
        element=ONE_POINT if accuracy >= ONE_POINT_FROM else None,
    )
