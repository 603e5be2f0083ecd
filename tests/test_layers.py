"""Where a file lies says what it may import: downwards only, and never in a circle."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MAY_IMPORT = {
    "hcm": {"hcm"},
    "meshes": {"meshes"},
    "reference_fem": {"reference_fem", "meshes"},
    "validation": {"hcm", "meshes", "reference_fem", "validation"},
}
# Rooms of a package, and files beside them, from the ground up; those of one floor do not import
# each other.
FLOORS = {
    "hcm": (
        ("arrays", "bounds", "linked"), ("assumptions", "compiled", "parameters"), ("beam",),
        ("contact",), ("assembly",), ("integrators",), ("results",), ("loop", "taps", "workload"),
        ("model",), ("flight", "reference_solution", "vary"), ("estimates", "start"),
        ("stepping",), ("modal_flight",), ("simulate",), ("accuracy",), ("batch",),
    ),
    "reference_fem": (
        ("arrays", "linked"), ("compiled", "results", "torques"), ("elements", "settings", "ties"),
        ("contact", "mesh_sets", "rigid", "stable_step"), ("joints", "statics"), ("model",),
        ("cautions", "flight", "workload"), ("dynamics",), ("scene",), ("estimates",),
        ("simulate",),
    ),
    "validation": (
        ("errors",), ("harness",), ("scenes",), ("models",), ("runs", "curve_files"), ("compare",),
        ("identify",), ("converge", "render", "sweep"), ("validate",), ("peers",), ("studies",),
        ("cli",),
    ),
}  # fmt: skip
STUDIES = ("assumptions", "bench", "calibration", "evidence", "paper", "stress")


def modules() -> dict[str, Path]:
    """Every module of the packages by its dotted name."""
    return {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for package in MAY_IMPORT
        for path in sorted((ROOT / package).rglob("*.py"))
    }


MODULES = modules()


def imported(name: str) -> Iterator[str]:
    """Modules of ours that one imports, also inside functions and for type checks."""
    for node in ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}: relative import"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                if full in MODULES:
                    yield full
                elif node.module in MODULES:
                    yield str(node.module)


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_packages_import_only_what_they_may(package: str) -> None:
    wrong = [
        f"{name} imports {other}"
        for name in MODULES
        if name.split(".")[0] == package
        for other in imported(name)
        if other.split(".")[0] not in MAY_IMPORT[package]
    ]
    assert not wrong


@pytest.mark.parametrize("package", FLOORS)
def test_rooms_import_downwards(package: str) -> None:
    floor = {room: i for i, rooms in enumerate(FLOORS[package]) for room in rooms}
    wrong = []
    for name in MODULES:
        if not name.startswith(f"{package}."):
            continue
        room = name.split(".")[1]
        for other in imported(name):
            if not other.startswith(f"{package}."):
                continue
            below = other.split(".")[1]
            if below != room and floor[below] >= floor[room]:
                wrong.append(f"{name} imports {other}")
    assert not wrong


def test_studies_do_not_import_each_other() -> None:
    wrong = [
        f"{name} imports {other}"
        for study in STUDIES
        for name in MODULES
        if name.startswith(f"validation.studies.{study}.")
        for other in imported(name)
        if any(other.startswith(f"validation.studies.{also}.") for also in STUDIES if also != study)
    ]
    assert not wrong


def test_no_module_imports_itself_by_way_of_others() -> None:
    """A package's ``__init__`` counts as its module: it only hands names on."""
    graph = {name: set(imported(name)) - {name} for name in MODULES}
    while True:
        leaves = {name for name, others in graph.items() if not others}
        if not leaves:
            break
        graph = {name: others - leaves for name, others in graph.items() if name not in leaves}
    # what is left lies on a circle or leads to one
    reached = set().union(*graph.values()) if graph else set()
    assert not {name for name in graph if name in reached}


def test_solvers_tests_do_not_import_the_comparison() -> None:
    for package in ("hcm", "meshes", "reference_fem"):
        for path in (ROOT / "tests" / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
                names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
                assert not [n for n in names if n.split(".")[0] == "validation"], path


def test_the_pages_name_files_that_there_are() -> None:
    """Whole paths, or their ends where the folder is said before."""
    files = [f"/{path.relative_to(ROOT).as_posix()}" for path in ROOT.glob("[!.]*/**/*.py")]
    pages = (page.read_text(encoding="utf-8") for page in (ROOT / "docs").rglob("*.md"))
    named = re.findall(r"\w[\w/-]*\.py\b", "\n".join(pages))
    assert len(named) > 50
    assert not [name for name in named if not any(f.endswith(f"/{name}") for f in files)]
