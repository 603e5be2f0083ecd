"""Coordinates y of a chain in which its hinges hold and its mass is one: q = y T, T M T^T = 1."""

from typing import NamedTuple

import numpy as np

from hcm.arrays import Floats, Ints
from hcm.assembly.equations import fill_chords, residual_from_chords, tangent
from hcm.assembly.minimal_coordinates import without_hinges
from hcm.beam.banded_ldl import HALF_BANDWIDTH, storage
from hcm.beam.chain import Chain
from hcm.compiled import entry
from hcm.contact.contract import Law
from hcm.contact.law import IN_FLIGHT


class NormalCoordinates(NamedTuple):
    """The coordinates of a chain out of contact; c of them, n bordered places.

    place : (c,) one bordered place of each hinge-free coordinate. band : places in `banded_ldl`'s
    storage, (2, b), of the matrix's lower half. entries : (2, b) their places in a dense matrix,
    and in its upper half. lower : (c, c) Cholesky's factor of N^T M N, scaled by the places' units,
    and its inverse. to_places : (c, n) T.
    """

    chain: Chain
    law: Law
    place: Ints
    band: Ints
    entries: Ints
    lower: Floats
    inverse: Floats
    to_places: Floats


def normal_coordinates(chain: Chain, law: Law) -> NormalCoordinates:
    """The coordinates of `chain`; law : of its contact, which does not act."""
    source, place = without_hinges(chain)
    held, c = np.flatnonzero(source >= 0), place.size
    i = np.repeat(held, HALF_BANDWIDTH + 1)
    back = np.tile(np.arange(HALF_BANDWIDTH + 1), held.size)
    inside = (i >= back) & (source[i - back] >= 0)
    i, back = i[inside], back[inside]
    row, column = source[i], source[i - back]
    band = np.array([HALF_BANDWIDTH + i, HALF_BANDWIDTH - back])
    # what is on the diagonal of the band is counted once
    entries = np.array([row * c + column, np.where(back > 0, column * c + row, c * c)])
    none = np.empty((0, 0))
    bare = NormalCoordinates(chain, law, place, band, entries, none, none, none)
    lower = np.linalg.cholesky(mass_and_stiffness(bare, np.zeros((1, source.size)), 0.0)[0])
    inverse = np.linalg.inv(lower)
    to_places = np.zeros((c, source.size))
    to_places[:, held] = inverse[:, source[held]] * chain.scale[held]
    return bare._replace(lower=lower, inverse=inverse, to_places=to_places)


def mass_and_stiffness(of: NormalCoordinates, q: Floats, weight: float = 1.0) -> Floats:
    """N^T (M + weight K) N, scaled, at each bordered q (K, n): (K, c, c); weight : s^2."""
    c = of.place.size
    out = np.zeros((len(q), c * c + 1))
    fill_tangents(q, weight, of.chain, of.law, storage(q.shape[1]), of.band, of.entries, out)
    return out[:, :-1].reshape(len(q), c, c)


@entry
def fill_tangents(
    q: Floats, weight: float, chain: Chain, law: Law, rows: Floats, band: Ints, entries: Ints,
    out: Floats,
) -> None:  # fmt: skip
    """Add the scaled M + weight K at each q (K, n) to `out` (K, c^2 + 1), zeros."""
    for k in range(q.shape[0]):
        tangent(q[k], weight, 0.0, chain, IN_FLIGHT, law, rows)
        for e in range(band.shape[1]):
            value = rows[band[0, e], band[1, e]]
            out[k, entries[0, e]] += value
            out[k, entries[1, e]] += value


@entry
def fill_residuals(
    q: Floats, chain: Chain, law: Law, still: Floats, chords: Floats, out: Floats
) -> None:
    """Write K q - Q at each q (K, n) to `out` (K, n); still : (n,) zeros. chords : (N, 2) work."""
    for k in range(q.shape[0]):
        fill_chords(q[k], chain, chords)
        residual_from_chords(q[k], chords, still, still, chain, IN_FLIGHT, law, out[k])
