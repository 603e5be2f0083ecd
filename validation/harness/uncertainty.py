"""A number beside the estimate of its error, with the digits that the error leaves."""

import math

DIGITS = 6  # of a number, however small its error is


def with_error(value: float, error: float | None, digits: int = DIGITS) -> str:
    """``95.2 +- 0.4``: the error to one digit, to two where the first is a 1, upwards.

    error : absolute; None: none is stated; infinite: nothing is known of it, ``95.1523 +- ?``.
    digits : where there is none.
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
    """A number that only says how large something is: ``0.53``, ``160``."""
    return f"{float(f'{value:.2g}'):g}"
