"""The scene's solver tables: an accuracy, or the settings that the solvers declare."""

import dataclasses
from collections.abc import Iterable
from functools import cache
from typing import Annotated, Any, Literal, Self, get_args, get_origin

from pydantic import AfterValidator, Field, create_model, model_validator

from validation.scenes.scene_number import SceneNumber
from validation.scenes.tables import LONGEST_M, Table, refuse, state_key

ACCURACY_ADVICE = "1e-3 is 0.1 %"
NO_ACCURACY = "none"
SIZES = (
    "section_size", "axial_size", "tip_size", "growth", "patch_size", "halvings", "full_volume"
)  # fmt: skip
"""Keys of the solid models' mesh; left out, they are the preset's."""
DEFAULT_ACCURACY = {"hcm": 1e-3, "fem": 1e-2}
"""The accuracy that `run` and `validate` ask for if the scene leaves it open."""
DECIDED = {
    "hcm": {"accuracy"},
    "fem": {
        "accuracy", "preset", "mesh", "section_size", "axial_size", "tip_size", "contact", "flight"
    },
}  # fmt: skip
"""Keys that exclude the default accuracy if a scene states one of them: solving again, in minutes
of an explicit flight, would not reduce the errors that springs or stated sizes leave."""


def _declared(settings: type, left_out: Iterable[str]) -> dict[str, Any]:
    """Keys of a solver's table, from the fields of its settings; None: the scene states nothing."""
    keys: dict[str, Any] = {}
    for field in dataclasses.fields(settings):
        if field.name in left_out:
            continue
        kind: Any = field.type
        members = get_args(kind)
        if get_origin(kind) is Annotated:
            number, bound = members
            kind = Annotated[number | None, SceneNumber(**vars(bound))]
        else:  # names or a solver's object: a scene states a name
            kind = next((m for m in members if get_origin(m) is Literal), kind) | None
        keys[state_key(field.name)] = (kind, None)
    return keys


def settings_of(solver: str) -> dict[type, tuple[str, ...]]:
    """Settings of a solver, and which of their fields a scene cannot state.

    Those are the postures that a figure needs, sampling, where refinement is aimed, and the guards.
    """
    if solver == "hcm":
        import hcm

        return {hcm.Settings: ("frame_times",), hcm.Assumptions: ()}
    import meshes
    import reference_fem

    return {reference_fem.Settings: OUTPUT, meshes.Sizing: LIMITS}


class AccuracyTable(Table):
    """What may be asked of a solver instead of stating its settings."""

    accuracy: Annotated[
        float | str | None,
        SceneNumber(at_least=1e-6, at_most=0.1, advice=ACCURACY_ADVICE, or_word=NO_ACCURACY),
    ] = None
    """Largest relative error wanted in peak force, impulse, duration and arrival, against the same
    model's converged answer; settings that are not stated follow from it. "none": they have the
    defaults given here, 20 elements and a preset's mesh. Left out: the commands run and validate
    ask for 1e-3 of hcm, 1e-2 of fem, other commands for none."""


class FemMeshTable(AccuracyTable):
    """The solid models' mesh: a preset gives sizes and contact law, other keys override it."""

    preset: Literal["contact", "fast", "ls-dyna-like", "converged"] = "contact"
    """Sizes of the mesh and contact law, scaled with the diameter."""
    symmetry: bool = True
    """Whether half of the body is meshed in 3D, cut by its plane of motion."""
    shaft_radius: Annotated[float | None, SceneNumber("m", above=0, at_most=LONGEST_M)] = None
    """Radius of the holes for shafts at the hinges, also in a mesh file; left out: no holes, end
    faces turn about their axes."""
    flight_size: Annotated[float | None, SceneNumber("m", above=0, at_most=LONGEST_M)] = None
    """Edges of the mesh for flight = "coarse"; left out: a quarter of the smallest diameter."""
    mesh: str | None = None
    """Path of a mesh file, relative to the current folder, in place of the preset's mesh."""

    @model_validator(mode="after")
    def _mesh_or_sizes(self) -> Self:
        for key in SIZES:
            value = getattr(self, key)
            if self.mesh is not None and value is not None:
                key = f"solver.fem.{key}"
                text = "has no effect on a mesh from a file: leave it or solver.fem.mesh out"
                raise refuse(key, value, text)
        return self


OUTPUT = ("lead_steps", "output_interval", "max_samples", "snapshots", "energy_tolerance")
LIMITS = ("contact_angle", "max_elements", "max_updates")


BASES: dict[str, type[Table]] = {"hcm": AccuracyTable, "fem": FemMeshTable}
"""The keys of ``[solver.NAME]`` that its solver does not declare."""


@cache
def solver_table(name: str) -> type[Table]:
    """``[solver.hcm]`` or ``[solver.fem]``: the keys of `BASES` and the solver's settings."""
    declared: dict[str, Any] = {}
    for settings, left_out in settings_of(name).items():
        declared |= _declared(settings, left_out)
    return create_model(f"{name.title()}Table", __base__=BASES[name], **declared)


def _checked_by(name: str) -> AfterValidator:
    def check(stated: dict[str, Any]) -> dict[str, Any]:
        solver_table(name).model_validate(stated)
        return stated

    return AfterValidator(check)


class SolverTable(AccuracyTable):
    """What the scene states for each solver, checked by the bounds of that solver's settings.

    A solver's package, which takes a second to import, is imported only if the scene states
    something for it or its table is read, not for a scene that the other one solves.
    """

    stated_hcm: Annotated[dict[str, Any], _checked_by("hcm")] = Field({}, alias="hcm")
    stated_fem: Annotated[dict[str, Any], _checked_by("fem")] = Field({}, alias="fem")

    @property
    def hcm(self) -> Any:
        """The `solver_table` of this scene."""
        return solver_table("hcm").model_validate(self.stated_hcm)

    @property
    def fem(self) -> Any:
        """The `solver_table` of this scene."""
        return solver_table("fem").model_validate(self.stated_fem)

    def accuracy_of(self, solver: str) -> float | None:
        """The accuracy asked of ``hcm`` or ``fem``: from its own table, or the one for all."""
        own = getattr(self, solver).accuracy
        asked = self.accuracy if own is None else own
        return None if asked is None or asked == NO_ACCURACY else float(asked)

    def open_to_accuracy(self, solver: str) -> bool:
        """Whether the scene states neither an accuracy nor any of the keys in `DECIDED`."""
        stated = {"hcm": self.stated_hcm, "fem": self.stated_fem}[solver].keys()
        return self.accuracy is None and not stated & DECIDED[solver]
