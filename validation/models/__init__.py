"""Models by name: scene in, `Outcome` out. The contract is `adapter.Adapter`.

A model is an entry point of the group ``fingertap.models``: the built-in ones are named in this
project's ``pyproject.toml``. The model of any installed package that names one is available in
every command.
"""

import difflib
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import get_args

from validation.errors import RunFailedError, UserError
from validation.harness.identity import places
from validation.models.adapter import Adapter, Kind
from validation.scenes.scene import Scene
from validation.scenes.solver_tables import DEFAULT_ACCURACY

GROUP = "fingertap.models"
MEMBERS = (*Adapter.__annotations__, "refusal", "warm_up", "run")


@cache  # what is installed does not change while a program runs
def _entry_points() -> dict[str, tuple[EntryPoint, ...]]:
    """Entry points by the model's name, those of one name with different values."""
    found: dict[str, dict[str, EntryPoint]] = {}
    for entry_point in entry_points(group=GROUP):
        found.setdefault(entry_point.name, {})[entry_point.value] = entry_point
    return {name: tuple(by_value.values()) for name, by_value in found.items()}


def model_names() -> tuple[str, ...]:
    """Names of the installed models."""
    return tuple(_entry_points())


def is_own(name: str) -> bool:
    """Whether a model is one of this project's solvers."""
    return any(one.value.startswith(__name__) for one in _entry_points().get(name, ()))


def adapter(name: str, option: str = "--model") -> Adapter:
    """The adapter of a model; a refusal begins with the option that named it.

    Raises UserError: no installed model has that name, or several have.
    Raises RunFailedError: the model's package can't be loaded, or what it names is not an adapter.
    """
    named = _entry_points().get(name, ())
    if not named:
        near = difflib.get_close_matches(name, _entry_points(), n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise UserError(
            f"{option} {name!r}: unknown; {hint}installed models are {', '.join(_entry_points())}"
        )
    if len(named) > 1:
        packages = " and ".join(f"{one.dist and one.dist.name} ({one.value})" for one in named)
        raise UserError(f"{option} {name}: is a model of {packages}; uninstall one of the packages")
    (entry_point,) = named
    try:
        found: Adapter = entry_point.load()
    except Exception as error:  # anything may go wrong in the import of another package
        raise RunFailedError(
            f"model {name} ({entry_point.value}): cannot be loaded: {type(error).__name__}: {error}"
        ) from error
    if what := _fault(found, name):
        raise RunFailedError(f"model {name} ({entry_point.value}): is not an adapter: it {what}")
    return found


def _fault(found: Adapter, name: str) -> str:
    """Why `found` is no adapter of that name; empty if it is one."""
    if isinstance(found, type):
        return "is a class; the entry point must name an object of it"
    if missing := [member for member in MEMBERS if not hasattr(found, member)]:
        return f"lacks {', '.join(missing)}"
    if found.name != name:
        return f"calls itself {found.name!r}"
    if found.kind not in (kinds := get_args(Kind)):
        return f"has kind = {found.kind!r}: must be {' or '.join(kinds)}"
    sources: object = found.sources
    if not isinstance(sources, tuple):
        return f"has sources = {sources!r}: must be a tuple of names of modules"
    for source in sources:
        module = str(source).partition(".")[0]
        if module == "__main__" or not places(module):  # what runs, not what the model is
            return f"has {source!r} among its sources: name the modules of its code"
    return ""


def estimate_override(model: str, estimate: bool = False) -> tuple[str, ...]:
    """The override that switches the estimates of a model's errors off, unless they are wanted."""
    table = "" if estimate else adapter(model).settings
    return (f"solver.{table}.estimate=false",) if table else ()


def default_accuracy(model: str, tables: Scene) -> tuple[str, ...]:
    """The override that holds a model to its default accuracy, if the scene leaves it open."""
    table = adapter(model).settings
    if table not in DEFAULT_ACCURACY or not tables.solver.open_to_accuracy(table):
        return ()
    return (f"solver.{table}.accuracy={DEFAULT_ACCURACY[table]}",)
