"""What a run is given."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import meshes
from meshes.bounds import check_fields, check_kind
from reference_fem.dynamics.restart import digest
from reference_fem.rigid.rigid_chain import ChainState
from reference_fem.settings import Drive, Material, Settings, Surface


@dataclass(frozen=True)
class Scene:
    """A finger's mesh, what it touches, and how that is solved: see `simulate`.

    Raises ValueError: a part is of another kind, or `flight_mesh` does not fit `settings.flight`.
    """

    mesh: meshes.FingerMesh
    materials: Sequence[Material]
    surface: Surface
    drive: Drive
    settings: Settings
    start: ChainState | None = None
    flight_mesh: meshes.FingerMesh | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.materials, list | tuple):
            raise ValueError(f"materials = {self.materials!r}: must be a tuple; each a Material")
        for material in self.materials:
            check_kind("materials", material, Material)
        check_fields(self)
        if (self.settings.flight == "coarse") is not (self.flight_mesh is not None):
            raise ValueError(
                f"flight = {self.settings.flight!r}: a flight_mesh is for 'coarse' and needed "
                "there; give both or neither"
            )

    @property
    def given(self) -> dict[str, Any]:
        """The parts by their names, meshes by their digests."""
        parts = {**vars(self), "mesh": digest(self.mesh)}
        if self.flight_mesh is None:
            return {name: part for name, part in parts.items() if name != "flight_mesh"}
        return parts | {"flight_mesh": digest(self.flight_mesh)}


def check_optional(name: str, value: object, kind: type) -> None:
    """Raise ValueError where a value is neither None nor a `kind`."""
    if value is not None:
        check_kind(name, value, kind)
