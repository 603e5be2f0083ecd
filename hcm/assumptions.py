"""Assumptions about the finger and its contact: the paper's or the refined model's, each a switch
of its own.
"""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Literal

from hcm.bounds import ParameterError, check_fields

TIP = ("hertz", "lowest_point", "tip_compliance")
# (switch, another that it needs): the switch refines what the other introduces, Hertz's patch, a
# spherical tip or the tip's compliance.
NEEDS = (
    ("partial_slip", "hertz"),
    ("tip_compliance", "hertz"),
    ("tip_compliance", "lowest_point"),
    *(("deforming_tip", other) for other in TIP),
    *(
        (switch, other)
        for switch in ("growing_patch", "radiating_tip")
        for other in (*TIP, "deforming_tip")
    ),
)


@dataclass(frozen=True)
class Assumptions:
    """The paper's or the refined model's assumptions, except for the switches that are given."""

    assumptions: Literal["paper", "refined"] = "paper"
    """Value of the switches that are not given: off (the paper) or on (refined)."""
    rotary_inertia: bool | None = None
    """Sections resist turning, in flight and in contact."""
    half_ball: bool | None = None
    """The last phalanx's end, over a length of R, has a half-ball's mass, not a cylinder's."""
    lowest_point: bool | None = None
    """The tip touches with the lowest point of a sphere, the rigid end R of the last phalanx,
    instead of with the end of its axis."""
    hertz: bool | None = None
    """F_n is Hertz's instead of tip.normal_stiffness times the indentation."""
    partial_slip: bool | None = None
    """Parts of the patch slip while others stick, instead of the whole patch at once."""
    shear: bool | None = None
    """Sections rotate relative to the axis: shear deformation (Timoshenko)."""
    tip_compliance: bool | None = None
    """The tip is elastic between the beam's end and the patch."""
    deforming_tip: bool | None = None
    """The tip's compliance includes finite strain by the material's law, and its parts' inertia. By
    St. Venant-Kirchhoff's law friction softens the patch."""
    growing_patch: bool | None = None
    """The tip's compliance grows with the radius of the patch (not by the neo-Hookean law)."""
    radiating_tip: bool | None = None
    """F_n has a part -D k^2 g. by the speed of approach: waves carry energy away from the patch."""
    cauchy_stress: bool | None = None
    """The stress at R is Cauchy's at finite strain, as the finite elements read it, instead of E
    times the strain."""
    whole_tap: bool | None = None
    """A touch that soon follows a separation belongs to the same tap (`hcm.taps.tap`)."""

    def __post_init__(self) -> None:
        check_fields(self)
        for switch, other in NEEDS:
            if self.has(switch) and not self.has(other):
                raise ParameterError(
                    f"{switch} = true: needs {other} = true; set {other} to true or {switch} to"
                    " false"
                )

    def has(self, switch: str) -> bool:
        """Whether a refinement is switched on."""
        value = getattr(self, switch)
        return self.assumptions == "refined" if value is None else bool(value)

    @cached_property
    def any(self) -> bool:
        """Whether any refinement of the beams or their contact is switched on."""
        return any(self.has(field.name) for field in fields(self)[1:] if field.name != "whole_tap")

    @property
    def needs_stiffness(self) -> bool:
        """Whether tip.normal_stiffness enters: by F_n, or by the spring of a patch that slips as a
        whole.
        """
        return not self.has("partial_slip")


PAPER = Assumptions()
