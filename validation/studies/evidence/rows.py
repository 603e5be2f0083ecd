"""The contract of a piece of evidence: one problem that somebody else solved or measured.

Its `solve` gives rows, each an outside number beside ours; `compare.differences` judges them.
Levels are those of a validation hierarchy (ASME V&V 10): a tap is only as credible as its parts.
"""

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from validation import DATA
from validation.compare.differences import Verdict, judge
from validation.harness.store import Store
from validation.models.adapter import Progress

Level = Literal["element", "beam", "contact", "impact", "tap"]
LEVELS: tuple[Level, ...] = get_args(Level)
WIDEST = 10.0  # percent: errors beyond which agreement says nothing


@dataclass(frozen=True)
class EvidenceRow:
    """One number by others and by our model, in `unit`, each with its error.

    ours, ours_error : None where our model does not get there; `remark` says why.
    """

    quantity: str
    unit: str
    model: str
    outside: float
    outside_error: float
    ours: float | None
    ours_error: float | None
    remark: str = ""

    @property
    def verdict(self) -> Verdict | None:
        """The difference over the outside number, percent, against both errors."""
        return judge(self.ours, self.outside, self.ours_error, self.outside_error, WIDEST)


Solve = Callable[[Progress, Store], Iterable[EvidenceRow]]


@dataclass(frozen=True)
class Piece:
    """One problem; `name` is its key.

    source : whose numbers, where from, who read them off a figure. what : the problem, and why they
    differ if that is known. modules, data : code and files that the rows depend on. solve : makes
    the rows; its store keeps parts that take minutes. absent : why it cannot be run now, "" if it
    can. slow : whether ``--quick`` leaves it out.
    """

    name: str
    title: str
    level: Level
    source: str
    what: str
    modules: tuple[str, ...]
    solve: Solve
    absent: Callable[[], str] = lambda: ""
    slow: bool = False
    data: tuple[Path, ...] = ()


TEXTS = tomllib.loads((DATA / "evidence.toml").read_text("utf-8"))


def new_piece(
    name: str, solve: Solve, key: str = "", words: Mapping[str, str] | None = None, **further: Any
) -> Piece:
    """A piece whose title, level, source and what are those in ``data/evidence.toml``.

    They are kept apart from the code of the rows, that of the module of `solve` with its imports,
    any change of which computes those again.

    key : the texts' there; empty: `name`. words : fill the texts in. further : fields of `Piece`.
    """
    given = {**TEXTS["shared"], **(words or {})}
    texts = {field: text.format(**given) for field, text in TEXTS[key or name].items()}
    said: dict[str, Any] = {field: " ".join(text.split()) for field, text in texts.items()}
    module = getattr(solve, "func", solve).__module__
    return Piece(name, **said, modules=(module,), solve=solve, **further)
