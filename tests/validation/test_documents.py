"""What README and the pages under docs/ show beside commands: scenes, plans, programs, links."""

import re
import runpy
import subprocess
import tomllib
from importlib import metadata
from pathlib import Path
from urllib.parse import urlsplit

import matplotlib as mpl
import pytest
from matplotlib import pyplot as plt
from packaging.requirements import Requirement

from tests.validation.commands import Capture, Patch
from validation.cli import app
from validation.render.off_screen import LIBRARIES, missing_libraries
from validation.scenes.load import validate
from validation.sweep.plan import read_plan

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *(p for p in sorted(DOCS.rglob("*.md")) if "generated" not in p.parts)]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXAMPLES = sorted((DOCS / "gallery").glob("*.py"))


def blocks(path: Path, language: str) -> list[str]:
    text = path.read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def test_two_commands_do_all_the_set_up() -> None:
    main_job, tests = (block.strip() for block in blocks(PAGES[0], "sh"))
    for command in (main_job, tests):
        assert "\n" not in command
        assert "python3 -m venv .venv" in command
        assert "python3-venv" in command
        assert all(library in command for library in LIBRARIES.split())
    assert main_job.endswith("fingertap validate")
    assert tests.endswith("python -m pytest -n auto --dist loadfile")


def test_ci_runs_the_readmes_test_command() -> None:
    shown = subprocess.run(
        [ROOT / ".ci" / "run", "--show"], capture_output=True, text=True, check=True, timeout=30
    )
    assert shown.stdout.strip() == blocks(PAGES[0], "sh")[1].strip()


def test_every_option_named_alone_is_one() -> None:
    known = app.generate_docs(output_format="markdown", recursive=True)
    for page in PAGES:
        for option in re.findall(r"`(--[a-z-]+)", page.read_text(encoding="utf-8")):
            assert option in known, (page.name, option)


def test_scenes_and_plans_shown_are_such(tmp_path: Path) -> None:
    (text,) = blocks(DOCS / "how_to" / "scene.md", "toml")
    assert validate(tomllib.loads(text), "docs").solver.fem.preset == "contact"
    commented = re.sub(r"^# (\w+ = [^#]*).*$", r"\1", text, flags=re.MULTILINE)
    without = commented.replace("torques = [0.0, 0.0, 0.0]", "# torques")
    assert validate(tomllib.loads(without), "docs").material.relaxation_time == 1e-5
    path = tmp_path / "plan.toml"
    path.write_text(blocks(DOCS / "how_to" / "sweep.md", "toml")[0], encoding="utf-8")
    assert len(read_plan(path).vary) == 4


@pytest.mark.parametrize("number", [0, 1, 2])
def test_the_python_shown_runs(number: int, capsys: Capture) -> None:
    exec(blocks(DOCS / "reference" / "api.md", "python")[number], {})
    peak = float(capsys.readouterr().out.split()[0])
    # design.md: 64.46 N from the reduced model; 57 to 96 N over meshes and penalties of the solid
    assert peak == pytest.approx(64.46, rel=1e-3) if number < 2 else 50 < peak < 100


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_ends_in_a_figure(path: Path, monkeypatch: Patch) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 60
    assert len(EXAMPLES) == 8
    if "pyvista" in path.read_text(encoding="utf-8") and missing_libraries():
        pytest.skip(missing_libraries())
    mpl.use("Agg")
    drawn: list[int] = []
    monkeypatch.setattr(plt, "show", lambda: drawn.extend(plt.get_fignums()))
    try:
        runpy.run_path(str(path), run_name="__main__")
        assert drawn
        assert all(axis.has_data() for axis in plt.figure(drawn[-1]).axes)
    finally:
        plt.close("all")


def test_equations_become_what_browsers_draw_or_are_refused() -> None:
    pytest.importorskip("latex2mathml", reason="pip install -e '.[docs]'")
    mathml = runpy.run_path(str(DOCS / "mathml.py"))["mathml"]
    assert "<mi>\N{MATHEMATICAL BOLD SMALL Q}</mi>" in mathml(r"\mathbf q", "inline")
    assert "<mi>\N{MATHEMATICAL BOLD CAPITAL PHI}</mi>" in mathml(r"\boldsymbol\Phi_q", "inline")
    for unknown in (r"\nothing x", r"\begin{aligned} a &= b \end{aligned}"):
        with pytest.raises(ValueError, match="no MathML for"):
            mathml(unknown, "block")
    found = [
        tex
        for page in PAGES
        for tex in re.findall(r"\$\$(.+?)\$\$", page.read_text("utf-8"), re.DOTALL)
    ]
    assert len(found) > 15
    assert all(mathml(tex, "block").startswith("<math") for tex in found)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_files_that_a_page_names_exist(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
        if target.startswith("http"):
            of = urlsplit(target)
            assert (of.scheme, of.query) == ("https", "")
            assert re.fullmatch(r"([a-z0-9-]+\.)+[a-z]{2,}", of.netloc), target
        elif not target.startswith("auto_gallery"):
            assert (page.parent / target).exists(), target


def test_dependencies_have_lower_bounds_that_are_met_here() -> None:
    extras = PROJECT["optional-dependencies"]
    for requirement in map(Requirement, PROJECT["dependencies"] + extras["test"]):
        assert any(bound.operator == ">=" for bound in requirement.specifier), requirement
        assert metadata.version(requirement.name) in requirement.specifier, requirement
