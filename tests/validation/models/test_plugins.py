"""Models that come through the entry points: used as the built-in ones, and never trusted."""

import importlib
import json
import math
import os
import sys
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.validation.commands import Capture, Run, call
from validation import models
from validation.harness.identity import program
from validation.harness.provenance import installed
from validation.harness.run_files import Fields
from validation.models.adapter import Outcome
from validation.models.curves import Curves, record_of, tap_scalars, touches_of_tap
from validation.models.solid import Solid
from validation.peers import exudyn_model
from validation.scenes.load import changed_scene, load_scene

EXAMPLE = Path(__file__).parents[3] / "docs" / "plugin-example"


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The example of the documentation, as if it were installed."""
    monkeypatch.syspath_prepend(EXAMPLE)
    return importlib.import_module("rigid_rod")


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], Any]], None]:
    """Put a model behind the entry point ``mine``, beside the built-in ones."""

    def entry_point(load: Callable[[], Any]) -> None:
        mine = SimpleNamespace(load=load, value="rigid_rod")
        found = {**models._entry_points(), "mine": (mine,)}
        monkeypatch.setattr(models, "_entry_points", lambda: found)

    return entry_point


def half_sine() -> Curves:
    time = np.linspace(0.0, 1e-3, 1001)
    force = 5.0 * np.sin(np.pi * (time - 2e-4) / 4e-4)
    force[(time < 2e-4) | (time > 6e-4)] = 0.0
    return Curves(time, force, -0.5 * force)


def test_scalars_of_a_half_sine_are_its_own() -> None:
    # trapezoid of a half sine over n = 400 steps: 1 - pi^2/(12 n^2) of 2 F T/pi; ends to a step
    found = tap_scalars(half_sine())
    assert found["peak_normal_force_N"] == pytest.approx(5.0, rel=1e-12)
    assert found["peak_tangential_force_N"] == pytest.approx(-2.5, rel=1e-12)
    assert found["normal_impulse_N_s"] == pytest.approx(2 * 5.0 * 4e-4 / np.pi, rel=1e-5)
    assert found["contact_duration_s"] == pytest.approx(4e-4, abs=1e-6)
    assert found["contact_time_s"] == pytest.approx(2e-4, abs=1e-6)


def test_example_runs_as_a_model_by_its_equations(
    example: ModuleType,
    install: Callable[[Callable[[], Any]], None],
    fingertap: Run,
) -> None:
    install(lambda: example)
    found = json.loads(fingertap("run", "soft", "--model", "mine", "--json").out)
    # energy of the impact returns all its momentum: impulse = 2 m_eff v, duration = pi sqrt(m/k)
    duration, speed = found["contact_duration_s"], -found["tip_velocity_at_contact_m_per_s"][1]
    mass = 0.78e6 * (duration / np.pi) ** 2
    assert found["normal_impulse_N_s"] == pytest.approx(2 * mass * speed, rel=1e-4)
    assert 0.0 < found["wall_time_s"] < 60.0  # it states none: that of its `run`
    ended = fingertap("run", "driven-1", "--model", "mine")
    assert "torques are not carried" in ended.refusal


def _changed(**changes: Any) -> Callable[..., Any]:
    """A run whose record is the half sine's with changes."""

    def run(scene: Any, progress: Any = None, checkpoint: Any = None) -> Outcome:
        return Outcome(replace(record_of(half_sine(), scene, "mine"), **changes))

    return run


def _no_number() -> dict[str, Any]:
    history = record_of(half_sine(), load_scene("soft"), "mine").history
    return {**history, "normal_force_N": np.full_like(history["time_s"], np.nan)}


def _lists(scene: Any, *_: Any) -> Outcome:
    curves: Any = Curves
    return Outcome(record_of(curves([0.0, 1.0], [0.0, 1.0]), scene, "mine"))


def _complex(scene: Any, *_: Any) -> Outcome:
    time = np.linspace(0.0, 4e-3, 5)
    force = np.array([0.0, 1.0, 2.0, 1.0, 0.0], dtype=complex)
    return Outcome(record_of(Curves(time, force), scene, "mine"))


def _no_fields(scene: Any, *_: Any) -> Outcome:
    given: Any = "fields"
    return replace(_whole(scene), fields=given)


def _fields_of_real_cells(scene: Any, *_: Any) -> Outcome:
    return replace(_whole(scene), fields=Fields(np.zeros((4, 2)), np.array([[0, 1, 2, 2.5]]), ()))


def _fields_of_another_mesh(scene: Any, *_: Any) -> Outcome:
    points, cells = np.zeros((4, 2)), np.array([[0, 1, 2, 4]])
    return replace(_whole(scene), fields=Fields(points, cells, ()))


def _whole(scene: Any) -> Outcome:
    time, force = np.linspace(0.0, 4e-3, 5), np.array([0.0, 1.0, 2.0, 1.0, 0.0])
    return Outcome(record_of(Curves(time, force), scene, "mine"))


def _exits(*_: Any, **__: Any) -> Outcome:
    sys.exit()


def _raises(*_: Any, **__: Any) -> Outcome:
    raise ZeroDivisionError("of its own\nin two lines")


def test_whole_numbers_are_times_and_forces_too() -> None:
    """An unknown F_t took their type, and with it the smallest whole number there is."""
    curves = Curves(np.arange(5), np.array([0, 1, 2, 1, 0]))
    record = record_of(curves, load_scene("soft"), "mine")
    assert np.isnan(record.history["tangential_force_N"]).all()
    assert record.summary["peak_normal_force_N"] == 2.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"run": _raises}, "ZeroDivisionError: of its own in two lines"),
        ({"run": _exits}, "SystemExit: no message"),
        ({"run": lambda *_: None}, "gave a NoneType"),
        ({"run": lambda *_: Outcome({"peak": 1})}, "gave dict as record, not RunRecord"),
        ({"run": _lists}, "time_s is a list: must be a NumPy array"),
        ({"run": _complex}, "normal_force_N is an array of complex128: must be one of real"),
        ({"run": _no_fields}, "gave str as fields, not Fields"),
        ({"run": _fields_of_real_cells}, "fields.cells are 1 of float64: must be whole numbers"),
        ({"run": _fields_of_another_mesh}, "fields.cells name points 0 to 4, but there are 4"),
        ({"run": _changed(summary={"peak_normal_force_N": float("nan")})}, "peak_normal_force_N"),
        ({"run": _changed(summary={})}, "summary"),
        ({"run": _changed(history=_no_number())}, "normal_force_N is not finite"),
        ({"run": _changed(history={"time_s": np.zeros((3, 2))})}, "time_s"),
        ({"run": _changed(status="FINE")}, "status"),
        ({"name": "yours"}, "calls itself 'yours'"),
        ({"run": None}, "not callable"),
    ],
)
def test_model_that_fails_is_named_in_one_line(
    changes: dict[str, Any],
    words: str,
    example: ModuleType,
    install: Callable[[Callable[[], Any]], None],
    tmp_path: Path,
    fingertap: Run,
) -> None:
    broken = SimpleNamespace(**{**vars(example), **changes})
    install(lambda: broken)
    ended = fingertap("run", "soft", "--model", "mine", "--out", tmp_path)
    assert ended.code == 1
    assert words in ended.line
    assert "mine" in ended.line


def test_what_a_model_prints_is_no_part_of_the_output(
    example: ModuleType,
    install: Callable[[Callable[[], Any]], None],
    capfd: Capture,
) -> None:
    def run(scene: Any, progress: Any = None, checkpoint: Any = None) -> Outcome:
        print("itself")
        os.system("echo echoed")
        outcome: Outcome = example.run(scene)
        return outcome

    install(lambda: SimpleNamespace(**{**vars(example), "run": run}))
    assert call("run", "soft", "--model", "mine", "--json") == 0
    said = capfd.readouterr()
    assert sorted(said.err.split("\n")) == ["", "echoed", "itself"]
    assert json.loads(said.out)["model"] == "mine"


def test_a_model_that_runs_another_elsewhere_keeps_its_name_and_the_folder(
    example: ModuleType,
    install: Callable[[Callable[[], Any]], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    fingertap: Run,
) -> None:
    """`validate` took its record for the other's, and its files lay where it worked."""

    def run(scene: Any, progress: Any = None, checkpoint: Any = None) -> Outcome:
        other = changed_scene("other", scene.document, ["surface.friction=0.9"], "other")
        return models.adapter("hcm").run(other, progress)

    def moves() -> None:
        os.chdir("/")

    install(lambda: SimpleNamespace(**{**vars(example), "run": run, "warm_up": moves}))
    monkeypatch.chdir(tmp_path)
    assert fingertap("run", "soft", "--model", "mine", "--out", "here").code == 0
    summary = json.loads((tmp_path / "here/run/soft-mine/summary.json").read_text())
    assert (summary["scene"], summary["model"]) == ("soft", "mine")
    made_of = tomllib.loads(summary["provenance"]["scene_toml"])
    assert made_of["surface"]["friction"] == 0.5


def test_model_that_cannot_be_loaded_or_is_none_is_named(
    example: ModuleType, install: Callable[[Callable[[], Any]], None], fingertap: Run
) -> None:
    def changed(**members: Any) -> Callable[[], Any]:
        return lambda: SimpleNamespace(**{**vars(example), **members})

    for what, model, code, words in (
        (lambda: importlib.import_module("no_such_package"), "mine", 1,
         "model mine (rigid_rod): cannot be loaded: ModuleNotFoundError"),
        (SimpleNamespace, "mine", 1, "lacks name, kind"),
        (lambda: Solid, "mine", 1, "it is a class; the entry point must name an object"),
        (SimpleNamespace, "mime", 2, "did you mean mine?"),
        (changed(name="other"), "mine", 1, "calls itself 'other'"),
        (changed(kind="surrogate"), "mine", 1, "kind = 'surrogate': must be reduced or reference"),
        (changed(sources=("rigid_rod", "nomod.x")), "mine", 1, "has 'nomod.x' among its"),
        (changed(sources=("__main__",)), "mine", 1, "has '__main__' among its"),
        (changed(sources="rigid_rod"), "mine", 1, "has sources = 'rigid_rod': must be a tuple"),
    ):  # fmt: skip
        install(what)
        ended = fingertap("run", "soft", "--model", model)
        assert ended.code == code
        assert words in ended.line


def test_a_refusal_that_fails_ends_validate_in_one_line(
    example: ModuleType, install: Callable[[Callable[[], Any]], None], fingertap: Run
) -> None:
    install(lambda: SimpleNamespace(**{**vars(example), "refusal": _raises}))
    for roles in (("--models", "mine"), ("--models", "hcm", "--reference", "mine")):
        ended = fingertap("validate", "soft", *roles)
        assert ended.code == 1
        assert "scene soft, model mine: ZeroDivisionError: of its own in two lines" in ended.line
    install(lambda: SimpleNamespace(**{**vars(example), "refusal": lambda _: sys.exit()}))
    ended = fingertap("validate", "soft", "--models", "mine")
    assert ended.code == 1
    assert "scene soft, model mine: SystemExit: no message" in ended.line


def test_two_packages_with_a_model_of_one_name_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fingertap: Run
) -> None:
    """The one that Python's path names last was run, also in the place of a built-in model."""
    for name, value in (("usurper", "rigid_rod"), ("copy", "validation.models.solid:FEM2D")):
        folder = tmp_path / f"{name}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Name: {name}\nVersion: 1.0\n", "utf-8")
        model = "hcm" if name == "usurper" else "fem2d"
        (folder / "entry_points.txt").write_text(f"[{models.GROUP}]\n{model} = {value}\n", "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    models._entry_points.cache_clear()
    try:
        line = fingertap("run", "soft", "--model", "hcm").refusal
        assert models.adapter("fem2d").name == "fem2d"  # twice the same object
    finally:
        models._entry_points.cache_clear()
    assert all(package in line for package in ("fingertap (", "usurper (rigid_rod)"))


def test_result_is_of_the_code_that_a_model_has_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "its_package").mkdir()
    (tmp_path / "its_package" / "__init__.py").write_text("import numpy\n")
    monkeypatch.syspath_prepend(tmp_path)
    from validation.harness import identity

    before = identity.source_digest(identity.closure(["its_package"])[0])
    (tmp_path / "its_package" / "part.py").write_text("x = 1\n")
    assert identity.source_digest(identity.closure(["its_package"])[0]) != before
    assert "numpy" in program("its_package")["versions"]


@pytest.mark.skipif(not installed("exudyn"), reason="extra bench")
@pytest.mark.parametrize(
    ("scene", "known"),
    # the last tap lasts 2 ms, and bends the finger more: their strains differ
    [
        (("soft",), 1e-3),
        (("hard",), 1e-3),
        (("soft", "material.youngs_modulus=1e7", "tip.normal_stiffness=1e4"), 2e-3),
    ],
)
def test_exudyn_agrees_where_the_tip_slides(
    scene: tuple[str, ...], known: float, fingertap: Run
) -> None:
    name, *overrides = scene
    given = [word for text in overrides for word in ("--set", text)]
    found = {
        model: json.loads(fingertap("run", name, "--model", model, "--json", *given).out)
        for model in ("hcm", "exudyn")
    }
    for key in ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s"):
        assert found["exudyn"][key] == pytest.approx(found["hcm"][key], rel=known), key


@pytest.mark.skipif(not installed("exudyn"), reason="extra bench")
def test_exudyn_refuses_what_it_cannot_model(fingertap: Run) -> None:
    """A tip that sticks was given the force of one that slides, 8 % too low."""
    sticks = fingertap("run", "soft", "--model", "exudyn", "--set", "surface.friction=1.3")
    assert sticks.code == 1
    assert "surface.friction = 1.3: the tip sticks or turns back" in sticks.err
    lossy = fingertap("run", "soft", "--model", "exudyn", "--set", "tip.restitution=0.8")
    assert "tip.restitution = 0.8; use --model hcm" in lossy.refusal
    assert "drive.torques" in fingertap("run", "driven-1", "--model", "exudyn").refusal
    turned = load_scene("soft", ("start.angles=0.1",))
    assert "a start other than level" in exudyn_model.refusal(turned)
    assert not exudyn_model.refusal(load_scene("soft", ("start.angles=0.0", "start.rates=0.0")))


def test_scalars_that_contradict_the_curves_are_said() -> None:
    """They count, as a solver may know them better than its samples do."""
    scene, own = load_scene("soft"), tap_scalars(half_sine())["peak_normal_force_N"]
    near = replace(half_sine(), scalars={"peak_normal_force_N": 1.04 * own})
    assert record_of(near, scene, "mine").message == ""
    record = record_of(replace(near, scalars={"peak_normal_force_N": 3.0}), scene, "mine")
    assert record.value("peak_normal_force_N") == 3.0
    assert record.message == (
        f"scalars.peak_normal_force_N = 3 is used, but the curves give {own:.4g}"
    )
    unknown = replace(near, scalars={"peak_normal_force_N": None}, errors={"contact_time_s": None})
    assert record_of(unknown, scene, "mine").message == ""
    nothing = replace(near, scalars={"peak_normal_force_N": math.nan})
    assert "= nan is used" in record_of(nothing, scene, "mine").message
    dragged = replace(half_sine(), tangential_force_N=0.6 * half_sine().normal_force_N)
    assert "reaches 0.6 of normal_force_N" in record_of(dragged, scene, "mine").message


def test_a_touch_is_of_the_tap_by_how_long_that_lasts_so_far() -> None:
    """10 s, then after 15 s a touch of 1 s, after 40 s another: within 2 x 10 s and 2 x 26 s."""
    time = np.arange(120.0)
    touches = np.zeros(time.size, dtype=bool)
    for first, after in ((1, 11), (26, 27), (67, 68)):
        touches[first:after] = True
    assert touches_of_tap(time, touches) == (1, 68, 3, 3)
