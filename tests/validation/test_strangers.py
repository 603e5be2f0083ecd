"""Scenes, meshes and stored results are data: nothing in them runs, leads away or fills memory."""

import ast
from pathlib import Path

import pytest

from tests.validation.commands import Run
from validation.render.run_folder import read_steps

ROOT = Path(__file__).parents[2]
PACKAGES = ("hcm", "meshes", "reference_fem", "validation")
RUNS_DATA = {"pickle", "cPickle", "dill", "cloudpickle", "marshal", "shelve", "joblib", "yaml"}
RUNS_TEXT = {"eval", "exec", "compile", "__import__"}


def violations(source: str) -> list[str]:
    """What in a module would run data that it reads."""
    found = []
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Import(names=names):
                found += [a.name for a in names if a.name.split(".")[0] in RUNS_DATA]
            case ast.ImportFrom(module=str(module)) if module.split(".")[0] in RUNS_DATA:
                found.append(module)
            case ast.Call(func=ast.Name(id=name)) if name in RUNS_TEXT:
                found.append(name)
            case ast.keyword(arg="allow_pickle", value=ast.Constant(value=True)):
                found.append("allow_pickle")
            case ast.keyword(arg="shell", value=ast.Constant(value=True)):
                found.append("shell")
            case _:
                pass
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_no_module_runs_what_it_reads(package: str) -> None:
    paths = sorted((ROOT / package).rglob("*.py"))
    assert len(paths) > 10
    bad = {str(path): found for path in paths if (found := violations(path.read_text("utf-8")))}
    assert bad == {}


def test_numpy_archives_are_read_without_objects() -> None:
    """Every ``np.load`` says so itself: the default could change."""
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.Call) and ast.unparse(node.func) == "np.load":
                    assert "allow_pickle=False" in ast.unparse(node), path


@pytest.mark.parametrize(
    "source",
    ["import pickle", "from joblib import Memory", "eval(text)", "np.load(f, allow_pickle=True)",
     "subprocess.run(line, shell=True)"],
)  # fmt: skip
def test_the_search_finds_what_it_looks_for(source: str) -> None:
    assert len(violations(source)) == 1


@pytest.mark.parametrize(
    ("overrides", "parts"),
    [
        (["finger.elements=1000000000"], ["3000000000 beam elements", "GiB", "s a time step"]),
        (["finger.elements=1" + 400 * "0"], ["finger.elements", ">= 1 and <= 1e+12"]),
        (["finger.phalanges=200", "finger.elements=200", "surface.height=0.1"],
         ["40000 beam elements", "GiB"]),
        (["solver.hcm.end_time=1e4", "solver.hcm.flight_step=1e-8",
          "solver.hcm.contact_step=1e-8", "finger.elements=20"],
         ["1e+12 steps", "6e+07 s of solving"]),
        (["solver.hcm.max_steps=1000000000"], ["GiB", "at most 4 GiB"]),
    ],
)  # fmt: skip
def test_what_cannot_end_well_is_refused_with_its_cost(
    overrides: list[str], parts: list[str], fingertap: Run
) -> None:
    given = [text for override in overrides for text in ("--set", override)]
    line = fingertap("run", "soft", "--model", "hcm", "--json", *given).refusal
    for part in parts:
        assert part in line


@pytest.mark.parametrize("name", ["../out.vtu", "/etc/hostname", "a/b.vtu", ".."])
def test_a_collection_does_not_lead_out_of_its_folder(name: str, tmp_path: Path) -> None:
    text = f'<VTKFile><Collection><DataSet timestep="0" file="{name}"/></Collection></VTKFile>'
    (tmp_path / "tap.pvd").write_text(text)
    with pytest.raises(ValueError, match="own folder"):
        read_steps(tmp_path)
