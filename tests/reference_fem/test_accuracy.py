"""Sizes of a mesh follow from the accuracy by the powers of the errors that they leave."""

import pytest

from reference_fem.estimates.accuracy import RELAXATION_SHARE, sizes_for
from reference_fem.estimates.mesh_error import Resolution


def test_sizes_leave_errors_in_proportion_to_the_accuracy() -> None:
    """Estimated errors without another mesh to compare: shares of what is asked for."""
    left = []
    for accuracy in (2.5e-3, 5e-3, 1e-2):
        sizes = sizes_for(accuracy)
        left.append(Resolution(sizes.edge, 1.0, sizes.section).alone("contact_duration_s"))
    assert left[1] / left[0] == pytest.approx(2.0)
    assert left[2] / left[1] == pytest.approx(2.0)
    assert sizes_for(0.1).edge < 0.5  # halved cells resolve the patch at every accuracy


def test_what_is_cheaper_is_taken_where_the_accuracy_allows() -> None:
    strict, usual, loose = (sizes_for(a) for a in (5e-3, 1e-2, 2e-2))
    assert strict.edge < usual.edge < loose.edge
    assert [s.element for s in (strict, usual, loose)] == [None, None, "hex8-one-point"]


def test_the_material_is_the_same_at_every_accuracy() -> None:
    """Else errors would be those of another answer than the one that meshes come to."""
    assert [sizes_for(a).relaxation for a in (2e-3, 1e-2, 0.1)] == [0.0] * 3
    assert [sizes_for(a, 1.0).relaxation for a in (2e-3, 1e-2, 0.1)] == [RELAXATION_SHARE] * 3


def test_a_tip_that_slides_with_little_friction_stays_elastic() -> None:
    """Of the study's fingers one at 0.24 flutters by 5 % of its peak, none below 0.15."""
    assert [sizes_for(1e-2, mu).relaxation for mu in (0.1, 0.24)] == [0.0, RELAXATION_SHARE]


@pytest.mark.parametrize("accuracy", [0.0, 1e-3, 0.5, float("nan"), "1e-2"])
def test_what_no_mesh_keeps_is_refused(accuracy: float) -> None:
    with pytest.raises(ValueError, match=r"must be 0\.002 to 0\.1 for finite elements"):
        sizes_for(accuracy)
