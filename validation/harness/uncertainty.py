"""A number and its estimated error, with as many digits as the error leaves meaningful."""

import math
import re

DIGITS = 6  # most digits of a number, however small its error is
UNKNOWN = 3  # digits of a number whose error is unknown
SMALLEST = 1e-300  # an error below it is none: its power of ten is no number
PLAIN = 1e-4, 1e7  # sizes of numbers that are written without a power of ten
NUMBER = re.compile(r"\b\d[\d.]*(?:e[+-]?\d+)?\b")


def with_error(value: float, error: float | None, digits: int = DIGITS) -> str:
    """``95.2 +- 0.4``: the error rounded up to one digit, to two if the first is a 1; with a power
    of ten outside `PLAIN`, ``1.2625e-09 +- 5e-13``.

    error : absolute; None: none is stated; infinite: it is unknown, ``95.2 +- ?``.
    digits : of the number if there is no error.
    """
    value += 0.0  # no -0.0
    if error is None or error < SMALLEST:
        return f"{float(f'{value:.{digits}g}'):.{DIGITS}g}"
    if not math.isfinite(error):
        return f"{value:.{UNKNOWN}g} +- ?"
    place = math.floor(math.log10(error))
    place -= error < 2.0 * 10.0**place
    least = math.floor(math.log10(abs(value))) - DIGITS + 1 if value else place
    places = -max(place, least)
    up = math.ceil(error * 10.0**places * (1.0 - 1e-9)) / 10.0**places
    near = round(value, places) + 0.0
    if PLAIN[0] <= max(abs(value), error) < PLAIN[1]:
        digits = max(places, 0)
        return f"{near:.{digits}f} +- {up:.{digits}f}"
    shown, known = (math.floor(math.log10(abs(x) or up)) + places for x in (near, up))
    return f"{near:.{shown}e} +- {up:.{known}e}"


def two_digits(value: float) -> str:
    """A number to two digits, for orders of magnitude: ``0.53``, ``160``."""
    return f"{float(f'{value:.2g}'):g}"


def without_numbers(text: str) -> str:
    """The text with n for its numbers: the same for messages of one kind."""
    return NUMBER.sub("n", text)
