"""What a round tip's contact is given, and its memory of the tap."""

from typing import NamedTuple

from hcm.arrays import Floats
from hcm.compiled import kernel
from hcm.contact.law import RESTITUTION, ContactState

# Places of the law's memory.
TIP_X, GAP, SLOPE_X, SLOPE_Y, CONTACT_X, SPRING_X = range(6)
COMPLIANCE_XX, COMPLIANCE_XY, COMPLIANCE_YY = range(6, 9)
TANGENTIAL_FORCE, NORMAL_FORCE, INDENTATION = range(9, 12)
MEMORY = 12


class RoundTipLaw(NamedTuple):
    """Constants of the law, and its memory of the tap; a `ContactState` holds the rest.

    k : N/m^(3/2) if hertz, else N/m. restitution : e*. tangential_ratio : G*/E*, or eta^-2. mu.
    height : depth of the surface below the hinge, less R where the lowest point touches, m.
    radius : R, m. lowest, hertz : whether the lowest point touches, and whether F_n is Hertz's.
    growth : s, 1/m. plane_strain_modulus, effective_shear_modulus : E* and G*, Pa.
    tangential_stiffness : k_t, N/m. compliance : (5,) of `build`, softening : e, m/N.
    radiation, relaxation : D, m s/N, and tau, s, of `tip_damping`.
    springs, depth, width : (N,) u_i, x_i^2/R and dx_i, m; empty without partial slip.
    memory : (MEMORY,) of the last accepted step: X_C, g, r' of the tip, X; X of the springs; C_XX,
        C_XY, C_YY, of the touch; the springs' F_t and F_n; d.
    """

    k: float
    restitution: float
    tangential_ratio: float
    mu: float
    height: float
    radius: float
    lowest: bool
    hertz: bool
    growth: float
    plane_strain_modulus: float
    effective_shear_modulus: float
    tangential_stiffness: float
    compliance: Floats
    softening: float
    radiation: float
    relaxation: float
    springs: Floats
    depth: Floats
    width: Floats
    memory: Floats


@kernel
def strain_share(contact: ContactState, law: RoundTipLaw) -> float:
    """The material's rate of strain over that of d: e*^2 in restitution."""
    return law.restitution * law.restitution if contact.normal_mode == RESTITUTION else 1.0
