"""Every command that README, the pages under docs/ and the examples show: it is run, or named here.

Those of seconds run in CI, those of minutes behind the marker `slow`; the others are listed with
the reason. A command that stands in no list fails the first test, as one that no page shows.
"""

import re
import shlex
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import cyclopts
import pytest

from tests.processes import COMMAND, ROOT, python, started
from tests.validation.commands import Patch, Run, call
from tests.validation.sweep.test_dask import needs_dask
from tests.validation.test_documents import DOCS, PAGES, PROJECT, blocks
from validation import models
from validation.cli import app

SHOWN = [*PAGES, *sorted((DOCS / "gallery").glob("*.*"))]
FENCED = re.compile(r"^```([^\n]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
LANGUAGES = "", "sh", "console", "text", "toml", "python"
BEGINS = (
    r"(\S*bin/)?(\.ci/run|apt-get|bash|cd|conda|curl|dask|docker|export|fingertap|git|make|mpirun|pip"
    r"|podman|pytest|python3?|sbatch|scp|sh|sphinx-build|srun|ssh|sudo|uv|wget)( |$)"
)
# What stands for a name of the reader's.
STANDS_FOR = {"SCENE": "soft", "NAME.toml": "finger.toml", "PLAN.toml": "plan.toml"}

QUICK = (
    "--help", "schema", "new finger.toml", "identify", "identify torque",
    "run soft --model hcm", "run soft --model hcm --set surface.friction=0.7",
    "run soft --model hcm-refined --set material.relaxation_time=1e-5",
    "run soft --model hcm --accuracy 1e-4", "run finger.toml --model hcm",
    "run soft --model hcm --set solver.hcm.assumptions=refined", "run soft --model mine",
    "run soft --model fem3d --set solver.fem.preset=fast",
    "compare soft --model hcm --set surface.friction=0.7", "sweep plan.toml",
    "validate soft --reference curves.csv",
)  # fmt: skip
# Minutes each, in a process of its own; of what takes hours, what is run in its place.
SLOW = {
    **{line: line for line in (
        "run soft --model fem3d", "run finger.toml --model fem3d", "waterfall soft",
        "identify contact soft", "identify ramp", "render soft --interactive", "paper", "evidence",
        "validate", "validate finger.toml", "validate soft --models hcm,mine",
        "validate --models hcm,mine", "bench", "bench --skips", "converge soft", "study",
    )},
    "stress": "stress --quick",
    "calibrate": "calibrate --quick",
    "calibrate --first 2000": "calibrate --first 2000 --quick",
    "calibrate --accuracy 1e-3": "calibrate --accuracy 1e-3 --scenes 1",
    "calibrate --model fem3d --accuracy 1e-2 --scenes 135":
        "calibrate --model fem3d --accuracy 1e-2 --scenes 1",
    "calibrate --model fem3d --first 2000 --scenes 660":
        "calibrate --model fem3d --first 2000 --scenes 1",
    "python -m tests.faults.campaign --faults 200":
        "python -m tests.faults.campaign --faults 20 --only run limit",
    "python -m tests.hostile.campaign --tries 2000":
        "python -m tests.hostile.campaign --tries 20 --jobs 1",
    "python -m tests.same_bits OTHER_CHECKOUT": f"python -m tests.same_bits {ROOT}",
}  # fmt: skip
DASK = (
    "dask scheduler --host 127.0.0.1",
    "dask worker tcp://127.0.0.1:8786 --nthreads 1 --nworkers 8",
    "sweep plan.toml --dask tcp://127.0.0.1:8786",
)
SYSTEM = "changes the system; .ci/run does it, by the README's line"
INSTALLS = "takes packages from an index; .ci/run does it for what tests need"
ELSEWHERE = {
    "apt-get update": SYSTEM,
    "apt-get install -y python3-venv libgl1 libglu1-mesa libxft2 libxcursor1 libxinerama1 libgomp1"
    " libegl1": SYSTEM,
    "python3 -m venv .venv": INSTALLS, "pip install -e .": INSTALLS,
    "pip install -e .[test]": INSTALLS, "pip install -e .[docs]": INSTALLS,
    "pip install ./docs/plugin-example": "as above; here it is installed by a file of its name",
    "pip install fingertap[interactive]": INSTALLS, "pip install -e .[dask]": INSTALLS,
    ". activate": "tests call the environment's own programs",
    "sphinx-build docs out/docs": "by .ci/run, without the gallery, which test_documents.py runs",
    "sphinx-build -W docs out/docs": "as above",
    **dict.fromkeys((
        ".ci/run", "python -m pytest -n auto --dist loadfile", "python -m pytest -m slow",
        "pytest -m slow",
        "python -m pytest -m slow tests/validation/test_documented_commands.py",
    ), "runs these tests"),
    "python -m tests.hostile.campaign": "the same with --tries is run",
    "dask scheduler": "listens to other machines; with --host 127.0.0.1 it is run",
    "ssh NODE dask worker tcp://HEAD:8786 --nthreads 1 --nworkers 32": "needs another machine",
}  # fmt: skip


def commands(path: Path) -> list[str]:
    """Lines of shells' blocks, other lines and code spans that begin with a program."""
    text = path.read_text(encoding="utf-8")
    lines, others = [], re.findall(r"(?<!`)`{1,2}([^`\n]+)`", text)
    for language, block in FENCED.findall(text):
        assert language in LANGUAGES or language.startswith("{"), (path.name, language)
        (lines if language in ("sh", "console") else others).extend(block.splitlines())
    lines += [line for line in others if re.match(BEGINS, line)]
    bare = "\n".join(lines).replace("$(command -v sudo) ", "").replace(".venv/bin/", "")
    parts = [shlex.split(part, comments=True) for part in re.split(" && |\n", bare)]
    shown = [" ".join(STANDS_FOR.get(word, word) for word in words) for words in parts if words]
    return [line.removeprefix("fingertap ") for line in shown]


def named_only(line: str) -> bool:
    """Whether it is a command's name, without the scene or plan that it needs."""
    try:
        app.parse_args(line, print_error=False, exit_on_error=False)
    except cyclopts.MissingArgumentError:
        return len(line.split()) <= 2 and "-" not in line
    except cyclopts.CycloptsError:
        return False
    return line == "fingertap"


def test_every_command_shown_is_run_or_named_here() -> None:
    shown = {line for path in SHOWN for line in commands(path) if not named_only(line)}
    known = {*QUICK, *SLOW, *DASK, *ELSEWHERE}
    assert shown == known, (shown - known, known - shown)
    assert len(known) == sum(map(len, (QUICK, SLOW, DASK, ELSEWHERE)))
    extras = {extra for line in known for extra in re.findall(r"install \S*\[(\w+)\]", line)}
    assert extras <= set(PROJECT["optional-dependencies"])


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the pages' readers have: a scene, curves, a plan, a model of their own."""
    folder = tmp_path_factory.mktemp("reader")
    assert call("new", folder / "finger.toml") == 0
    assert call("run", "soft", "--model", "hcm", "--out", folder / "made") == 0
    for name in ("curves.csv", "curves.csv.toml"):
        (folder / "made" / "run" / "soft-hcm" / name).rename(folder / name)
    plan = blocks(DOCS / "how_to" / "sweep.md", "toml")[0]
    (folder / "plan.toml").write_text(plan.replace("number = 128", "number = 2"), encoding="utf-8")
    # what pip makes of the example's [project.entry-points]
    distribution = folder / "installed" / "fingertap_rigid_rod-0.1.0.dist-info"
    distribution.mkdir(parents=True)
    (distribution / "METADATA").write_text("Name: fingertap-rigid-rod\nVersion: 0.1.0\n", "utf-8")
    (distribution / "entry_points.txt").write_text(
        "[fingertap.models]\nmine = rigid_rod\n", "utf-8"
    )
    return folder


@pytest.fixture
def reader(place: Path, tmp_path: Path, monkeypatch: Patch) -> Iterator[list[str]]:
    """Stand there, the plug-in installed; the paths of Python that make it so."""
    monkeypatch.chdir(place)
    paths = [str(place / "installed"), str(DOCS / "plugin-example"), str(ROOT)]
    models._entry_points.cache_clear()
    with monkeypatch.context() as patch:
        patch.setattr(sys, "path", paths + sys.path)
        yield paths
    models._entry_points.cache_clear()


@pytest.mark.parametrize("line", QUICK)
def test_a_quick_command_ends_well(
    line: str, fingertap: Run, reader: list[str], tmp_path: Path, monkeypatch: Patch
) -> None:
    if line.startswith("new"):
        monkeypatch.chdir(tmp_path)
    ended = fingertap(*line.split())
    assert ended.code == 0, ended.err
    if line == "run soft --model hcm":
        (printed,) = blocks(DOCS / "tutorial.md", "text")
        assert all(said in ended.out for said in printed.splitlines())


@pytest.mark.slow
@pytest.mark.parametrize("line", SLOW)
def test_a_long_command_ends_well(line: str, place: Path, reader: list[str]) -> None:
    program, *words = SLOW[line].split()
    run = words if program == "python" else ["-c", COMMAND, program, *words]
    ended = python(*run, env={"PYTHONPATH": ":".join(reader)}, cwd=place, timeout=7200.0)
    assert ended.returncode == 0, ended.stderr[-2000:]


@needs_dask
@pytest.mark.slow
def test_a_cluster_of_ones_own_by_the_commands_shown(place: Path, reader: list[str]) -> None:
    how = {"env": {"PYTHONPATH": ":".join(reader)}, "cwd": place}
    *cluster, sweep = [line.split() for line in DASK]
    with ExitStack() as processes:
        for _, what, *words in cluster:
            one = started("-m", f"distributed.cli.dask_{what}", *words, stderr=-3, **how)
            processes.callback(one.wait)
            processes.callback(one.terminate)
        ended = python("-c", COMMAND, *sweep, timeout=1200.0, **how)
    assert ended.returncode == 0, ended.stderr[-2000:]
