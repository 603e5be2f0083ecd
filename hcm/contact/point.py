"""A contact at the tip node itself (paper, fig. 2b): its position and velocity from the motion, and
the generalized force and the tangent of the law's force on the tip's coordinates (r, r').

These kernels define the interface of a contact's kinematics, which `round_tip_kinematics`,
`tip_compliance` and `tip_damping` follow; `contract` gives the constants that replace kernels which
only a round tip has.
"""

from hcm.arrays import Floats
from hcm.beam.banded_ldl import HALF_BANDWIDTH
from hcm.compiled import kernel
from hcm.contact.law import ContactLaw, ContactState, contact_force, contact_tangent


@kernel
def contact_position(
    q: Floats, tip: int, contact: ContactState, law: ContactLaw
) -> tuple[float, float]:
    """Contact position (X_C, u_Y), m."""
    return q[tip], q[tip + 1] + law.height


@kernel
def contact_velocity(
    q: Floats, v: Floats, tip: int, contact: ContactState, law: ContactLaw
) -> tuple[float, float]:
    """Contact velocity (v_t, v_n), m/s; with accelerations for v, the contact's acceleration."""
    return v[tip], v[tip + 1]


@kernel
def axis_end(q: Floats, tip: int, law: ContactLaw) -> tuple[float, float]:
    """End of the finger's axis, m; with v for q, its velocity, m/s."""
    return q[tip], q[tip + 1]


@kernel
def tip_force(
    q: Floats, v: Floats, tip: int, contact: ContactState, law: ContactLaw
) -> tuple[float, float]:
    """(F_t, F_n) of the surface on the tip, N."""
    return contact_force(q[tip], q[tip + 1] + law.height, contact, law)


@kernel
def subtract_force(
    q: Floats, v: Floats, tip: int, contact: ContactState, law: ContactLaw, out: Floats
) -> None:
    """Subtract the generalized contact force F_c, N and N m, from the residual `out` (n,)."""
    ft, fn = tip_force(q, v, tip, contact, law)
    out[tip] -= ft
    out[tip + 1] -= fn


@kernel
def add_tangent(
    q: Floats, weight: float, tip: int, scale: Floats, contact: ContactState, law: ContactLaw,
    rows: Floats,
) -> float:  # fmt: skip
    """Add -weight dF_c/dq to `rows` (`hcm.assembly.equations.tangent`), except for its unsymmetric
    part s c e_y^T; returns s, as `fill_column` fills c.
    """
    dtx, dty, dny = contact_tangent(contact, law)
    w = HALF_BANDWIDTH
    rows[w + tip, w] -= weight * dtx
    rows[w + tip + 1, w] -= weight * dny
    return -weight * dty


@kernel
def fill_column(
    q: Floats, tip: int, scale: Floats, contact: ContactState, law: ContactLaw, column: Floats
) -> None:
    """Write c, scaled by D, to the tip's places of `column` (n,)."""
    column[tip] = 1.0
