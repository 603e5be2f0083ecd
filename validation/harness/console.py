"""What the terminal shows: progress on standard error if it is a terminal, tables on output.

All text goes through `say` and `output`: scenes, files and stored results may come from others, and
control characters in them could move the cursor, change colours or rewrite lines.
"""

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from validation.harness.quantities import QUANTITIES, Quantity
from validation.harness.uncertainty import with_error

if TYPE_CHECKING:  # help and errors need no numpy
    from validation.harness.record import RunRecord


def printable(text: str) -> str:
    r"""The text with unprintable characters written as Python escapes, ESC as ``\x1b``."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def say(text: str) -> None:
    """Print one line on standard error; if that is closed, print nothing rather than fail."""
    with contextlib.suppress(OSError):
        print(f"fingertap: {printable(' '.join(text.split()))}", file=sys.stderr, flush=True)


def output(text: str) -> None:
    """Print lines on standard output."""
    print("\n".join(map(printable, text.split("\n"))), flush=True)


def say_error(text: str) -> None:
    """Print one line on standard error that says what went wrong."""
    say(f"error: {text}")


@contextlib.contextmanager
def progress_bar(title: str) -> Iterator[Callable[[float, str], None]]:
    """A callback (fraction, text) that draws a bar on an interactive standard error."""
    if not sys.stderr.isatty():
        yield lambda fraction, text: None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[what]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(escape(printable(title)), total=1.0, what="")
        yield lambda fraction, text: bar.update(
            task, completed=fraction, what=escape(printable(text))
        )


@contextlib.contextmanager
def output_kept() -> Iterator[None]:
    """In this context, what a model or a program started by it prints goes to standard error."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


WIDTH = 31  # width of the column of titles


def summary_text(record: "RunRecord") -> str:
    """A run's scalars, one per line."""
    lines = [f"{record.scene}, {record.label}: {record.status.lower().replace('_', ' ')}"]
    for entry in QUANTITIES:
        value = record.summary.get(entry.key)
        if isinstance(value, bool):
            text = "yes" if value else "no"
        elif value is not None and None not in (texts := [shown(p, record) for p in entry.parts]):
            text = ", ".join(map(str, texts))
        else:
            continue
        lines.append(f"  {entry.title:<{WIDTH}}{text} {entry.unit}".rstrip())
    lines += _accuracy_lines(record)
    if record.read_back:
        lines.append(f"  {'time and memory measured':<{WIDTH}}{record.measured}")
    return "\n".join(lines)


def _accuracy_lines(record: "RunRecord") -> Iterator[str]:
    """The accuracy wanted of the run, the one it expects, and the settings chosen for it."""
    if not (accuracy := record.accuracy):
        return
    expected = accuracy["expected"]
    text = "not estimated" if expected is None else f"expected {expected:.2g}"
    yield f"  {'relative error':<{WIDTH}}{text}, wanted {accuracy['wanted']:g}"
    for choice in accuracy["choices"]:
        yield f"    {choice['setting']:<{WIDTH - 2}}{choice['value']} ({choice['reason']})"


def shown(entry: Quantity, record: "RunRecord") -> str | None:
    """A run's number with its error, in the shown unit, which is left out; None if it has none."""
    value = entry.read(record)
    return None if value is None else with_error(value, entry.error(record), entry.digits)
