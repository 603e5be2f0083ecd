"""What the terminal shows: progress on standard error where someone watches, tables on output."""

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # help and errors need no numpy
    from validation.harness.record import RunRecord


def say(text: str) -> None:
    """One line on standard error."""
    print(f"fingertap: {' '.join(text.split())}", file=sys.stderr)


def say_error(text: str) -> None:
    """One line on standard error that says what went wrong."""
    say(f"error: {text}")


@contextlib.contextmanager
def progress_bar(title: str) -> Iterator[Callable[[float, str], None]]:
    """A callback (fraction, text) that draws a bar on an interactive standard error."""
    if not sys.stderr.isatty():
        yield lambda fraction, text: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[what]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=1.0, what="")
        yield lambda fraction, text: bar.update(task, completed=fraction, what=text)


ROWS = (  # title, key, factor, unit
    ("time of first contact", "contact_time_s", 1e3, "ms"),
    ("peak Fn", "peak_normal_force_N", 1, "N"),
    ("  at t - t_c", "peak_normal_force_time_s", 1e6, "us"),
    ("first peak Fn", "first_peak_normal_force_N", 1, "N"),
    ("peak Ft", "peak_tangential_force_N", 1, "N"),
    ("contact duration", "contact_duration_s", 1e6, "us"),
    ("normal impulse", "normal_impulse_N_s", 1e3, "mN s"),
    ("compression to restitution", "compression_to_restitution", 1, ""),
    ("stick to slip", "stick_to_slip", 1, ""),
    ("slip to stick", "slip_to_stick", 1, ""),
    ("peak stress at R", "peak_stress_R_Pa", 1e-6, "MPa"),
    ("energy residual", "energy_residual", 1, ""),
    ("elements", "elements", 1, ""),
    ("time step", "time_step_s", 1e9, "ns"),
    ("steps", "steps", 1, ""),
    ("solve time", "wall_time_s", 1, "s"),
    ("peak memory", "peak_memory_MB", 1, "MB"),
)


def summary_text(record: "RunRecord") -> str:
    """A run's scalars, one a line."""
    lines = [f"{record.scene}, {record.label}: {record.status.lower().replace('_', ' ')}"]
    velocity = record.summary.get("tip_velocity_at_contact_m_per_s")
    if velocity is not None:
        lines.append(f"  {'tip velocity at contact':<28}{velocity[0]:.4f}, {velocity[1]:.4f} m/s")
    for title, key, factor, unit in ROWS:
        value = record.value(key)
        if value is not None:
            lines.append(f"  {title:<28}{value * factor:.6g} {unit}".rstrip())
    if record.summary.get("reverse_slip") is not None:
        lines.append(f"  {'reverse slip':<28}{'yes' if record.summary['reverse_slip'] else 'no'}")
    if record.read_back:
        lines.append(f"  {'time and memory measured':<28}{record.measured}")
    return "\n".join(lines)
