"""``fingertap evidence``: what others computed or measured, beside what we compute."""

from functools import partial
from pathlib import Path

from validation.harness import identity
from validation.harness.command_line import Flag, Fresh
from validation.harness.console import output, progress_bar
from validation.harness.files import exclusive_folder, file_digest
from validation.harness.page import bar
from validation.harness.store import Store
from validation.models.adapter import Progress
from validation.studies.evidence import (
    hertz_ball,
    measured_ball,
    oblique_ball,
    pendulum,
    report,
    static_beam,
    taps,
)
from validation.studies.evidence.report import Shown, difference_text
from validation.studies.evidence.rows import LEVELS, EvidenceRow, Piece, new_piece

MODELS = ("hcm", "fem3d")
PIECES = sorted([
    *(
        new_piece(name, partial(static_beam.rows, *beam))
        for name, beam in static_beam.EXUDYN.items()
    ),
    new_piece("princeton", static_beam.princeton_rows),
    new_piece("pendulum", pendulum.rows, absent=pendulum.absent, slow=True),
    *(
        new_piece(f"hertz-{level}-{model}", partial(hertz_ball.rows, model, level == "contact"),
              "hertz", {"level": level, "model": model}, slow=model == "fem3d")
        for model in MODELS for level in ("contact", "impact")
    ),
    new_piece("oblique-theory", oblique_ball.theory_rows),
    *(
        new_piece(f"oblique-{model}", partial(oblique_ball.published_rows, model),
              "oblique-published", {"model": model}, slow=model == "fem3d")
        for model in MODELS
    ),
    new_piece("oblique-limit", oblique_ball.limit_rows, slow=True),
    new_piece("measured-ball", measured_ball.rows),
    *(
        new_piece(name, partial(taps.rows, tap), "tap", taps.words(tap), data=(taps.KEPT,))
        for name, tap in taps.TAPS.items()
    ),
], key=lambda one: LEVELS.index(one.level))  # fmt: skip


def evidence(*, quick: Flag = False, out: Path = Path("out"), fresh: Fresh = False) -> None:
    """Solve what others have solved or measured, element to tap, and judge each number.

    A piece whose program is missing is named with what to install. CalculiX' taps, ten minutes or
    more each, are read from stored results, with date and machine; --fresh runs them too.

    Parameters
    ----------
    quick
        Only what takes seconds and needs no other program: three minutes.
    out
        Folder for evidence/: index.html, evidence.csv, the figures.
    """
    with exclusive_folder(out / "evidence") as folder, progress_bar("evidence") as progress:
        store = Store(out / "store", fresh)
        shown = [look(piece, quick, store, progress) for piece in PIECES]
        stored = Store(out / "store")
        names = {one.piece.name for one in shown if one.rows}
        solved = {name: tap for name, tap in taps.TAPS.items() if name in names}
        report.draw_forces(folder / "taps.png", solved.values(), stored)
        for name in solved.keys() & report.FIELDS_OF:
            report.draw_field(folder / f"{name}.png", solved[name], stored)
        report.write_evidence(folder, shown)
    for one in shown:
        output(f"{one.piece.level}: {one.piece.title} {one.why}")
        for row in one.rows:
            numbers = bar(row.outside, row.outside_error), bar(row.ours, row.ours_error)
            wide = "".join(f" {number:>22}" for number in numbers)
            said = difference_text(row) + (f"; {row.remark}" if row.ours is None else "")
            output(f"  {row.quantity:<54} {row.model:<5}{wide} {row.unit:<5} {said}")
    output(f"files in {folder}")


def look(piece: Piece, quick: bool, store: Store, progress: Progress) -> Shown:
    """A piece's rows, stored or new, or why there are none."""
    inputs = {
        "result": "evidence", "piece": piece.name, "program": identity.program(*piece.modules),
        "data": [*map(file_digest, piece.data)],
    }  # fmt: skip
    found = store.find(inputs, list[EvidenceRow])
    if found is None:
        why = "left out by --quick" if quick and piece.slow else piece.absent()
        if why:
            return Shown(piece, (), why)
        try:
            found = store.obtain(
                inputs, list[EvidenceRow], lambda: list(piece.solve(progress, store))
            )
        except ArithmeticError as error:
            return Shown(piece, (), f"failed: {error}")
    return Shown(piece, tuple(found))
