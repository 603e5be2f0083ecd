"""Customized masses of the few elements of a flight, which keep their vibrations in phase.

With consistent masses a wave of wave number kappa runs fast on elements of length l: its frequency
is too high by (kappa l)^4/1440, with shear by much more. Here an element of mass m gets a further
kinetic energy for each axis,

    m/2 (e_2 c_2.^2 + e_3 c_3.^2),
    c_2 = l (r'_2 - r'_1),    c_3 = r_1 - r_2 + l (r'_1 + r'_2)/2,
    e_2 = (1 + 5 Phi)/720,
    e_3 = [23 + 170 Phi + 315 Phi^2 + 175 Phi^3
           + g (420 - 840 Phi - 2100 Phi^2 + 25200 g Phi)]/(2100 (1 + Phi)^3),

g = I/(A l^2) with rotary inertia, else 0, Phi of `hcm.beam.refinement`. c_2 and c_3 are the even
and the odd bending, which no rigid motion has: mass, centre and moment of inertia do not change.
With these e_2 and e_3 two more terms of a frequency's series in kappa l, at constant Phi and g in a
long row of elements, are those of Timoshenko's beam; the term (kappa l)^8 is wrong. Free ends and
hinges of a given beam leave larger errors: of order 6 in l without shear, 4 with it, 2 with rotary
inertia too, a tenth to a hundredth of those of consistent masses. Felippa, Guo and Park call this a
customized mass (Arch. Comput. Methods Eng. 22, 2015); e_2 and e_3 are ours, by computer algebra. An
end that tapers (a half-ball with its contact at the axis' end) gets those of a whole cylinder.

In contact the tip's force acts on one node, and with three elements or more consistent masses are
as good: from the first touch on they are used, with the contact's elements.
"""

import numpy as np

from hcm.assumptions import Assumptions
from hcm.beam.chain import Chain
from hcm.beam.refinement import beams_of, shear_number
from hcm.parameters import Finger


def shares(phi: float, g: float) -> tuple[float, float]:
    """e_2 and e_3 of elements with these Phi and I/(A l^2)."""
    odd = 23 + 170 * phi + 315 * phi**2 + 175 * phi**3
    odd += g * (420 - 840 * phi - 2100 * phi**2 + 25200 * g * phi)
    return (1 + 5 * phi) / 720, odd / (2100 * (1 + phi) ** 3)


def customized(chain: Chain, finger: Finger, assumptions: Assumptions) -> Chain:
    """The chain of `beams_of(finger)` with customized masses (N, 4, 4)."""
    mass, e, rotary = chain.mass.copy(), 0, assumptions.has("rotary_inertia")
    for beam in beams_of(finger, assumptions).phalanges:
        el = beam.length / beam.elements
        g = beam.second_moment / (beam.area * el**2) if rotary else 0.0
        even, odd = shares(shear_number(beam, assumptions), g)
        c2, c3 = np.array([0.0, -el, 0.0, el]), np.array([1.0, el / 2, -1.0, el / 2])
        own = even * np.outer(c2, c2) + odd * np.outer(c3, c3)
        mass[e : e + beam.elements] += beam.line_density * el * own
        e += beam.elements
    return chain._replace(mass=mass)
