"""What the terminal shows: progress on standard error where someone watches, tables on output."""

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from validation.harness.quantities import QUANTITIES

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


WIDTH = 31  # of the column of titles


def summary_text(record: "RunRecord") -> str:
    """A run's scalars, one a line."""
    lines = [f"{record.scene}, {record.label}: {record.status.lower().replace('_', ' ')}"]
    for entry in QUANTITIES:
        value = record.summary.get(entry.key)
        if isinstance(value, bool):
            text = "yes" if value else "no"
        elif isinstance(value, Sequence):
            text = ", ".join(f"{component * entry.factor:.4f}" for component in value)
        elif (shown := entry.read(record)) is not None:
            text = f"{shown:.6g}"
        else:
            continue
        lines.append(f"  {entry.title:<{WIDTH}}{text} {entry.unit}".rstrip())
    if record.read_back:
        lines.append(f"  {'time and memory measured':<{WIDTH}}{record.measured}")
    return "\n".join(lines)
