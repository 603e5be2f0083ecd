"""The numbers printed in the paper: shown beside ours, never used in a computation."""

import csv
from dataclasses import dataclass

from validation import DATA


@dataclass(frozen=True)
class Claim:
    """One printed number: a row of ``data/claims.csv``."""

    id: str
    where: str
    scene: str
    quantity: str
    paper_value: str
    unit: str
    kind: str
    note: str

    @property
    def number(self) -> float:
        """The printed number."""
        return float(self.paper_value)


def read_claims() -> dict[str, Claim]:
    """All of the paper's claims by id, in the order of the article."""
    with (DATA / "claims.csv").open(encoding="utf-8") as file:
        return {row["id"]: Claim(**row) for row in csv.DictReader(file)}


def find(where: str, scene: str, quantity: str) -> Claim | None:
    """The claim for a place, scene and quantity; None if the paper has none."""
    wanted = (where, scene, quantity)
    claims = read_claims().values()
    return next((c for c in claims if (c.where, c.scene, c.quantity) == wanted), None)
