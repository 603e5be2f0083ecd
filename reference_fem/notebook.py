"""A run as a notebook shows it: how it ended, its force, its numbers with errors, cautions."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

Numbers = Mapping[str, Any]
WIDTH, HEIGHT, POINTS = 480, 140, 400  # of the curve, in pixels


def run_html(notes: Sequence[str], numbers: Numbers, errors: Numbers, time: Any, force: Any) -> str:
    """HTML that loads nothing.

    notes : how the run ended, then its cautions. numbers, errors : by name with its SI unit; None
    is left out. time, force : (n,), s and N; drawn from the first to the last contact.
    """

    def cell(value: Any) -> str:
        parts = value if isinstance(value, tuple | list) else [value]
        return "<td>" + ", ".join(f"{p:.5g}" if isinstance(p, float) else str(p) for p in parts)

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
    rows = (f"<tr><th>{name}{cell(value)}{cell(errors.get(name, ''))}" for name, value in known)
    return f"{shown}<table><tr><th><th>value<th>± error{''.join(rows)}</table>"
