"""The numbers that the paper prints. They stand beside ours and enter no computation."""

import csv
from dataclasses import dataclass
from importlib import resources


@dataclass(frozen=True)
class Claim:
    """One printed number: its row in ``data/claims.csv``, where it stands, its value."""

    id: str
    where: str
    scene: str
    quantity: str
    value: str
    unit: str
    kind: str

    @property
    def number(self) -> float:
        """The printed number."""
        return float(self.value)


def read_claims() -> tuple[Claim, ...]:
    """All rows of the paper's claims."""
    with (
        resources.files("validation").joinpath("data", "claims.csv").open(encoding="utf-8") as file
    ):
        return tuple(
            Claim(
                row["id"],
                row["where"],
                row["scene"],
                row["quantity"],
                row["paper_value"],
                row["unit"],
                row["kind"],
            )
            for row in csv.DictReader(file)
        )


def find(claims: tuple[Claim, ...], where: str, scene: str, quantity: str) -> Claim | None:
    """The claim of that place, scene and quantity."""
    return next(
        (c for c in claims if (c.where, c.scene, c.quantity) == (where, scene, quantity)), None
    )
