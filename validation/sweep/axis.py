"""How a key of the scene varies in a sweep: a range, a list, or a distribution of scipy.stats."""

import math
from collections.abc import Iterable
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from validation.errors import UserError
from validation.scenes.messages import check_value, known_keys, nearest_key, show
from validation.scenes.scene_number import SceneNumber
from validation.scenes.tables import Table

MOST_POINTS = 10_000_000
WAYS = {  # allowed keys of each kind of axis, by the key that marks it
    "low": {"low", "high", "log", "count"},
    "values": {"values"},
    "distribution": {"distribution", "parameters", "count"},
}


class Axis(Table):
    """How a key varies: a range, a list, or a distribution of scipy.stats."""

    low: float | None = None
    """Lower end of a range, with `high`."""
    high: float | None = None
    """Upper end of a range, with `low`."""
    log: bool = False
    """Whether the range is even in the logarithm."""
    values: list[Any] | None = None
    """A list of any values that the key takes."""
    distribution: str | None = None
    """Name in scipy.stats, for example norm."""
    parameters: dict[str, float] = Field(default_factory=dict)
    """Parameters of the distribution, by its names: loc, scale, and its shapes."""
    count: Annotated[int, SceneNumber(integer=True, at_least=1, at_most=MOST_POINTS)] = 5
    """Number of points of a range or a distribution on a grid."""


def scene_number_of(key: str) -> SceneNumber | None:
    """The bounds of a scene's key; None if the key is not a number."""
    return next((q for q in known_keys()[key].metadata if isinstance(q, SceneNumber)), None)


def check_key(key: str, origin: str) -> None:
    """Refuse a key that no scene has.

    Raises UserError: the key is unknown; names the nearest one.
    """
    if key in known_keys():
        return
    if any(known.startswith(f"{key}.") for known in known_keys()):
        raise UserError(f'{origin}: is a table of keys; write each in quotes, "{key}.NAME" = ...')
    raise UserError(f"{origin}: unknown key of a scene; {nearest_key(key)}")


def clash(key: str, others: Iterable[str]) -> str:
    """The first of other keys that sets this one too (itself, its table, a key in it), else ''."""
    same = (o for o in others if f"{o}.".startswith(f"{key}.") or f"{key}.".startswith(f"{o}."))
    return next(same, "")


def check_apart(keys: Iterable[str], origin: str) -> None:
    """Refuse keys of which one sets another too.

    Raises UserError: two keys clash; names both.
    """
    seen: list[str] = []
    for key in keys:
        if other := clash(key, seen):
            raise UserError(f"{origin}{key}: {other} gives it a value too; leave one out")
        seen.append(key)


def check_axis(key: str, axis: Axis, origin: str) -> None:
    """Refuse an axis that is no range, list or distribution, or more than one of them."""
    ways = [axis.low is not None or axis.high is not None, axis.values is not None,
            axis.distribution is not None]  # fmt: skip
    if sum(ways) != 1:
        raise UserError(
            f"{origin}: must have low and high, or values, or distribution; give one of the three"
        )
    way = next(way for way, given in zip(WAYS, ways, strict=True) if given)
    for name in axis.model_fields_set - WAYS[way]:
        raise UserError(f"{origin}.{name}: has no meaning with {way}; leave it out")
    if axis.values is not None:
        if not axis.values:
            raise UserError(f"{origin}.values = []: must hold at least one value")
        for value in axis.values:
            check_value(key, value, f"{origin}.values")
        return
    quantity = scene_number_of(key)
    if quantity is None or quantity.only_list or quantity.integer:
        raise UserError(
            f"{origin}: is not a continuous number; give its values as a list, values ="
        )
    if axis.distribution is not None:
        frozen(axis, origin)
        return
    for name, bound in (("low", axis.low), ("high", axis.high)):
        if bound is None:
            raise UserError(f"{origin}: {name} is missing; a range has low and high")
        check_value(key, bound, f"{origin}.{name}")
    assert axis.low is not None
    assert axis.high is not None
    if not axis.low < axis.high:
        raise UserError(f"{origin}.low = {axis.low}: must be below high = {axis.high}")
    if axis.log and axis.low <= 0:
        raise UserError(f"{origin}.low = {axis.low}: must be above 0 where log = true")


def frozen(axis: Axis, origin: str) -> Any:
    """The axis' distribution, from scipy.stats."""
    from scipy import stats

    found = getattr(stats, str(axis.distribution), None)
    if not isinstance(found, stats.rv_continuous):
        raise UserError(
            f"{origin}.distribution = {axis.distribution!r}: must name a continuous distribution"
            " of scipy.stats, for example norm, truncnorm, lognorm or beta"
        )
    try:
        frozen = found(**axis.parameters)
        with np.errstate(all="ignore"):
            middle = float(frozen.ppf(0.5))
    except TypeError as error:
        names = ", ".join(filter(None, (found.shapes, "loc", "scale")))
        raise UserError(
            f"{origin}.parameters = {show(axis.parameters)}: scipy.stats.{axis.distribution} takes"
            f" {names}, all but loc and scale always"
        ) from error
    if not math.isfinite(middle):
        raise UserError(
            f"{origin}.parameters = {show(axis.parameters)}: scipy.stats.{axis.distribution} has"
            " no distribution with these; a scale, say, must be above 0"
        )
    return frozen
