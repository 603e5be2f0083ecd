"""Where a campaign works, what it compares with, and how it counts."""

import random
from dataclasses import dataclass, field
from pathlib import Path

from .commands import Ended, complete
from .results import collect, differences

Arguments = tuple[str, ...]


@dataclass
class Tally:
    """Faults of one kind, and what they cost."""

    kind: str
    injected: int = 0
    lost: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def check(self, good: bool, what: str) -> None:
        if not good:
            self.lost.append(what)


@dataclass
class Bench:
    """Where the campaign works: a folder, its dice, and undisturbed results by command."""

    folder: Path
    dice: random.Random
    whole: dict[Arguments, dict[str, str]] = field(default_factory=dict)
    seconds: dict[Arguments, float] = field(default_factory=dict)
    number: int = 0

    def fresh(self) -> Path:
        """A folder that was not there before."""
        self.number += 1
        path = self.folder / f"{self.number:04d}"
        path.mkdir(parents=True)
        return path

    def undisturbed(self, arguments: Arguments) -> dict[str, str]:
        """Results of a command that nothing disturbs."""
        if arguments not in self.whole:
            out = self.fresh()
            ended = complete(arguments, out)
            assert ended.code == 0, ended.error
            self.whole[arguments], self.seconds[arguments] = collect(out), ended.seconds
        return self.whole[arguments]

    def completes(self, tally: Tally, arguments: Arguments, out: Path, after: str) -> Ended:
        """The same command completes, with the results of an undisturbed one."""
        ended = complete(arguments, out)
        tally.check(ended.code == 0, f"{after}: exit code {ended.code}: {ended.error[-300:]}")
        others = differences(collect(out), self.undisturbed(arguments))
        tally.check(not others, f"{after}: other results in {others[:3]}")
        return ended
