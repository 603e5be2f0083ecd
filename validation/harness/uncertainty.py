"""A number and its estimated error, with as many digits as the error leaves meaningful."""

import math

DIGITS = 6  # most digits of a number, however small its error is


def with_error(value: float, error: float | None, digits: int = DIGITS) -> str:
    """``95.2 +- 0.4``: the error rounded up to one digit, to two if the first is a 1.

    error : absolute; None: none is stated; infinite: it is unknown, ``95.1523 +- ?``.
    digits : of the number if there is no error.
    """
    if error is None or error == 0.0:
        return f"{float(f'{value:.{digits}g}'):.{DIGITS}g}"
    if not math.isfinite(error):
        return f"{value:.{DIGITS}g} +- ?"
    place = math.floor(math.log10(error))
    place -= error < 2.0 * 10.0**place
    least = math.floor(math.log10(abs(value))) - DIGITS + 1 if value else place
    places = -max(place, least)
    up = math.ceil(error * 10.0**places * (1.0 - 1e-9)) / 10.0**places
    digits = max(places, 0)
    return f"{round(value, places) + 0.0:.{digits}f} +- {up:.{digits}f}"  # no -0.0


def two_digits(value: float) -> str:
    """A number to two digits, for orders of magnitude: ``0.53``, ``160``."""
    return f"{float(f'{value:.2g}'):g}"
