"""A run as a notebook shows it: how it ended, its force, its numbers with errors, cautions."""

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

Numbers = Mapping[str, Any]
WIDTH, HEIGHT, POINTS = 480, 140, 400  # of the curve: size in pixels, most points


def run_html(notes: Sequence[str], numbers: Numbers, errors: Numbers, time: Any, force: Any) -> str:
    """HTML of a run, which loads nothing from elsewhere.

    notes : how the run ended, then its cautions. numbers, errors : by name with its SI unit; None
    is left out. time, force : (n,), s and N; drawn from the first to the last contact.
    """

    def parts(value: Any) -> list[Any]:
        return list(value) if isinstance(value, tuple | list) else [value]

    def cells(value: Any, error: Any) -> str:
        stated = parts(error) if error is not None else [0.0] * len(parts(value))
        texts = [_to_known_digits(*of) for of in zip(parts(value), stated, strict=True)]
        known = ", ".join(f"{one:.2g}" for one in stated) if error is not None else ""
        return f"<td>{', '.join(texts)}<td>{known}"

    shown = "".join(f"<p>{escape(note)}</p>" for note in notes if note)
    touched = np.flatnonzero(force > 0.0)
    if touched.size > 1:
        t, f = time[touched], force[touched]
        kept = np.unique([*np.linspace(0, t.size - 1, POINTS, dtype=int), f.argmax()])
        x, y = WIDTH * (t - t[0]) / (t[-1] - t[0]), HEIGHT * (1.0 - f / f.max())
        line = " ".join(f"{x[i]:.1f},{y[i]:.1f}" for i in kept)
        said = f"Normal force from {1e3 * t[0]:.5g} to {1e3 * t[-1]:.5g} ms, peak {f.max():.5g} N"
        box = f"width='{WIDTH}' viewBox='-2 -2 {WIDTH + 4} {HEIGHT + 4}'"
        shown += f"<svg role='img' aria-label='{said}' {box}><polyline points='{line}' fill='none'"
        shown += f" stroke='#0072b2'/></svg><p>{said}</p>"
    known = [(name, value) for name, value in numbers.items() if value is not None]
    rows = (f"<tr><th>{name}{cells(value, errors.get(name))}" for name, value in known)
    return f"{shown}<table><tr><th><th>value<th>± error{''.join(rows)}</table>"


def _to_known_digits(value: Any, error: float) -> str:
    """A number with one digit more than its error leaves certain, five if no error is stated."""
    if not isinstance(value, float):
        return str(value)
    share = abs(value) / error if error > 0.0 else 0.0
    digits = min(max(math.ceil(math.log10(share)) + 1, 2), 6) if 0.0 < share < math.inf else 5
    return f"{value:.{digits}g}"
