"""The finger's equations without hinge multipliers: q = N z with N constant and boolean.

Hinges tie positions linearly, so every bordered place either carries an independent coordinate
(slopes, free positions), repeats one (the first node of phalanx w > 1 sits where phalanx w - 1
ends), or is zero (the fixed hinge; the places of the multipliers). `source` says which, and then

    N^T M N z.. = N^T (Q + tau + F_c - K q - D v).
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from hcm.arrays import Floats, Ints
from hcm.assembly.equations import residual
from hcm.beam.chain import Chain
from hcm.compiled import allocating
from hcm.contact.law import ContactLaw, ContactState, contact_force, particle_velocity


class Coordinates(NamedTuple):
    """The map from m independent coordinates to n bordered places, and the inverse mass.

    source : (n,) index into z, -1 where q is zero. place : (m,) one bordered place of each z.
    unit : (m,) 1 for positions, 1/l for slopes. inverse_mass : (m, m) inverse of N^T M N.
    """

    source: Ints
    place: Ints
    unit: Floats
    inverse_mass: Floats


def without_hinges(chain: Chain) -> tuple[Ints, Ints]:
    """`Coordinates.source` and `Coordinates.place` of `chain`."""
    n = chain.scale.size
    source = np.arange(n)
    dropped = np.zeros(n, dtype=bool)
    for lam, inner, outer in zip(chain.hinge, chain.hinge_inner, chain.hinge_outer, strict=True):
        for c in range(2):
            dropped[lam + c] = dropped[outer + c] = True
            source[lam + c] = -1
            source[outer + c] = inner + c if inner >= 0 else -1
    place = np.flatnonzero(~dropped)
    rank = np.full(n, -1, dtype=np.int64)
    rank[place] = np.arange(place.size)
    return np.where(source >= 0, rank[source], -1), place


def minimal_coordinates(chain: Chain) -> Coordinates:
    """Eliminate the hinges of `chain`."""
    n = chain.scale.size
    source, place = without_hinges(chain)
    expand_matrix = np.zeros((n, place.size))
    expand_matrix[source >= 0, source[source >= 0]] = 1.0
    mass = np.zeros((n, n))
    for place_of_element, one_component in zip(chain.first, chain.mass, strict=True):
        own = slice(place_of_element, place_of_element + 8)
        mass[own, own] += np.kron(one_component, np.eye(2))
    unit = chain.scale[place]
    # scaled by the units of z, N^T M N is well conditioned whatever the element length
    scaled = unit[:, None] * (expand_matrix.T @ mass @ expand_matrix) * unit
    inverse = cho_solve(cho_factor(scaled), np.eye(place.size))
    return Coordinates(source, place, unit, unit[:, None] * inverse * unit)


@allocating
def expand(z: Floats, source: Ints) -> Floats:
    """Bordered q = N z, (n,)."""
    q = np.zeros(source.size)
    for i in range(source.size):
        if source[i] >= 0:
            q[i] = z[source[i]]
    return q


@allocating
def acceleration(
    q: Floats, v: Floats, coordinates: Coordinates, chain: Chain, contact: ContactState,
    law: ContactLaw,
) -> Floats:  # fmt: skip
    """Independent accelerations z.. (m,) at the bordered coordinates q and velocities v (n,)."""
    source = coordinates.source
    still, out = np.zeros(q.size), np.empty(q.size)
    residual(q, v, still, chain, contact, law, out)
    force = np.zeros(coordinates.place.size)
    for i in range(source.size):
        if source[i] >= 0:
            force[source[i]] -= out[i]
    return coordinates.inverse_mass @ force


@allocating
def rate(
    y: Floats, origin: Floats, coordinates: Coordinates, chain: Chain, contact: ContactState,
    law: ContactLaw,
) -> Floats:  # fmt: skip
    """dy/dt of y = (z - origin, z., int F_n dt, -int F_t dX_P): m, m, 1 and 1 values."""
    m = coordinates.place.size
    q = expand(origin + y[:m], coordinates.source)
    v = expand(y[m : 2 * m], coordinates.source)
    tip = chain.tip
    ft, fn = contact_force(q[tip], q[tip + 1] + law.height, contact, law)
    out = np.empty(y.size)
    out[:m] = y[m : 2 * m]
    out[m : 2 * m] = acceleration(q, v, coordinates, chain, contact, law)
    out[2 * m] = fn
    out[2 * m + 1] = -ft * particle_velocity(
        q[tip + 1] + law.height, v[tip], v[tip + 1], contact, law
    )
    return out
