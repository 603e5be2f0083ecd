from pathlib import Path

import pytest
import tomli_w

import validation.scenes
from tests.processes import printed
from validation.errors import UserError
from validation.scenes.load import BUILT_IN, MAX_BYTES, load_scene, parse_value
from validation.scenes.messages import known_keys

T3_FACTOR = 7.04e-5  # `fingertap identify torque`


def refusal(*overrides: str, source: str = "soft") -> str:
    with pytest.raises(UserError) as caught:
        load_scene(source, overrides)
    text = str(caught.value)
    assert "\n" not in text
    assert "Traceback" not in text
    return text


# Table 1 and section 4.3 of the paper.
@pytest.mark.parametrize(
    ("name", "modulus", "density", "stiffness", "torques"),
    [
        ("hard", 20e9, 1048.7, 5.15e6, (0, 0, 0)),
        ("soft", 1e9, 1400, 0.78e6, (0, 0, 0)),
        ("driven-1", 0.1e9, 1400, 0.78e6, (0.01, 0.008, 30 * T3_FACTOR)),
        ("driven-2", 0.1e9, 1400, 0.78e6, (1, 0.8, 3000 * T3_FACTOR)),
        ("driven-3", 0.1e9, 1400, 0.78e6, (1, 0.9, 5500 * T3_FACTOR)),
    ],
)
def test_built_in_scenes_are_the_papers(
    name: str, modulus: float, density: float, stiffness: float, torques: tuple[float, ...]
) -> None:
    scene = load_scene(name).tables
    assert scene.material.youngs_modulus == modulus
    assert scene.material.density == density
    assert scene.material.poisson_ratio == 0.4
    assert scene.tip.normal_stiffness == stiffness
    assert scene.tip.restitution == 1
    assert scene.torque_rows == (pytest.approx(torques),)
    assert scene.surface.height == 0.1
    assert scene.surface.friction == 0.5
    assert scene.drive.gravity == 9.8
    assert not scene.drive.reaction
    assert scene.per_phalanx(scene.finger.length) == (0.04,) * 3
    assert scene.per_phalanx(scene.finger.diameter) == (0.015,) * 3
    assert sum(scene.elements) == 60


def test_a_file_that_is_called_as_a_built_in_scene_is_not_that_one(tmp_path: Path) -> None:
    own = tmp_path / "soft.toml"
    own.write_text((Path(validation.scenes.__file__).parent / "soft.toml").read_text())
    assert (load_scene(str(own)).name, load_scene("soft").name) == ("soft.toml", "soft")


def test_tangential_ratio_defaults_to_mindlin(tmp_path: Path) -> None:
    document = load_scene("soft").document
    del document["tip"]["tangential_ratio"]
    path = tmp_path / "mine.toml"
    path.write_text(tomli_w.dumps(document))
    scene = load_scene(str(path), ["material.poisson_ratio=0.25"])
    assert scene.name == "mine"
    assert scene.tables.tangential_ratio == pytest.approx(2 * 0.75 / 1.75)


def test_scene_survives_being_written_as_toml(tmp_path: Path) -> None:
    original = load_scene("driven-3", ["solver.fem.preset=ls-dyna-like", "solver.hcm.taps=2"])
    path = tmp_path / "copy.toml"
    path.write_text(tomli_w.dumps(original.document))
    assert load_scene(str(path)).tables == original.tables


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.7", 0.7),
        ("1e8", 1e8),
        ("-3", -3),
        (".6", 0.6),
        ("-5.e-3", -0.005),
        (".", "."),
        ("true", True),
        ("[1, 2.5]", [1, 2.5]),
        ('"fast"', "fast"),
        ("ls-dyna-like", "ls-dyna-like"),
        ("1 GPa", "1 GPa"),
        ("1\nother = 2", "1\nother = 2"),
    ],
)
def test_set_values_are_toml_or_a_bare_word(text: str, value: object) -> None:
    assert parse_value(text, "a") == value


@pytest.mark.parametrize("text", ["[.001, 0]", "{time=[0,.1]}", "[1, 2", "[" * 5000])
def test_a_list_that_is_none_is_no_bare_word(text: str) -> None:
    with pytest.raises(UserError, match=r"^--set finger\.length = .*: is not a TOML list or table"):
        load_scene("soft", [f"finger.length={text}"])


def test_overrides_apply_in_order_and_leave_the_scene_alone() -> None:
    changed = load_scene("soft", ["surface.friction=0.1", "surface.friction = 0.7"]).tables
    assert changed.surface.friction == 0.7
    assert load_scene("soft").tables.surface.friction == 0.5


def test_one_number_per_phalanx() -> None:
    scene = load_scene("soft", ["finger.phalanges=2", "finger.length=[0.05, 0.06]"]).tables
    assert scene.per_phalanx(scene.finger.length) == (0.05, 0.06)
    assert scene.per_phalanx(scene.finger.diameter) == (0.015, 0.015)
    assert scene.torque_rows == ((0, 0),)


def table(time: str, values: str, *parts: str) -> tuple[str, list[str]]:
    """Torques over time, and what the refusal must name."""
    rows = f", values={values}" if values else ""
    return f"drive.torques={{time={time}{rows}}}", list(parts)


# What is given, and every piece that the one line must name.
@pytest.mark.parametrize(
    ("override", "parts"),
    [
        ("finger.length=-0.04", ["finger.length", "-0.04", ">= 1e-09"]),
        ("finger.length=0", ["finger.length", ">= 1e-09"]),
        ("finger.length=[0.04, 0.04]", ["finger.length", "2 numbers for 3 phalanges", "give 3"]),
        ("finger.length=[0.04, 0.04, -1]", ["finger.length", "-1", ">= 1e-09"]),
        ("finger.length=[[0.04], 1, 1]", ["finger.length", "one per phalanx"]),
        ("finger.length=40", ["finger.length", "40", "<= 2", "not millimetres"]),
        ("finger.diameter=0.08", ["finger.length", "round end of 0.04 m", "finger.diameter"]),
        ("finger.diameter='15 mm'", ["finger.diameter", "15 mm", "in m", "without unit"]),
        ("finger.elements=1000000000", ["1000000000", "GiB", "s a time step"]),
        ("finger.elements=2.5", ["finger.elements", "2.5", "whole number"]),
        ("finger.elements=0", ["finger.elements", ">= 1"]),
        ("finger.phalanges=true", ["finger.phalanges", "true", "whole number"]),
        ("finger.phalanges=1e9", ["finger.phalanges", "whole number"]),
        (
            "material.youngs_modulus=1 GPa",
            ["material.youngs_modulus", "1 GPa", "in Pa", "without unit"],
        ),
        ("material.youngs_modulus=nan", ["material.youngs_modulus", "nan", "Pa"]),
        ("material.youngs_modulus=inf", ["material.youngs_modulus", "inf", "Pa"]),
        ("material.density=0", ["material.density", "kg/m3", ">= 1e-06"]),
        ("material.density=1" + "0" * 400, ["material.density", "<= 1e+06"]),
        ("material.poisson_ratio=0.5", ["material.poisson_ratio", "0.5", "< 0.5", "0.49"]),
        *(
            (f"material.relaxation_time={value}", ["material.relaxation_time", *parts])
            for value, parts in (
                ("-1e-6", ["-1e-06", ">= 0"]),
                ("2.0", ["2", "<= 1", "write seconds"]),
                ("10", ["<= 1", "pi f tau"]),
                ("nan", ["nan", "in s"]),
                ("inf", ["inf", "<= 1"]),
                ("'10 us'", ["10 us", "in s", "without unit"]),
                ("true", ["true", "number"]),
                ("[]", ["[]", "one per phalanx"]),
                ("[1e-6, 1e-6]", ["2 numbers for 3 phalanges", "give 3"]),
                ("[1e-6, -1e-6, 0.0]", ["-1e-06", ">= 0"]),
                ("[[1e-6], 0, 0]", ["one per phalanx"]),
                ("{ value = 1e-6 }", ["number", "in s"]),
            )
        ),
        ("material.relaxation=1e-6", ["material.relaxation", "did you mean", "relaxation_time"]),
        ("surface.friction=-1", ["surface.friction", "-1", ">= 0", "smooth"]),
        ("surface.height=-0.1", ["surface.height", "-0.1", "> 0", "above the finger"]),
        ("surface.height=0", ["surface.height", "above the finger"]),
        ("surface.height=0.0075", ["surface.height", "0.0075", "the surface would cut it"]),
        ("surface.height=0.12", ["surface.height", "never reached", "0.12 m long", "below"]),
        ("surface.height=[0.1]", ["surface.height", "[0.1]", "a number in m"]),
        ("surface.incline=20", ["surface.incline", "20", "in rad", "<= 1.5708", "0.349 rad"]),
        ("surface.incline='20 deg'", ["surface.incline", "20 deg", "in rad", "without unit"]),
        ("surface.incline=-1.6", ["surface.incline", ">= -1.5708", "drive.gravity < 0"]),
        ("surface.incline=[0.1]", ["surface.incline", "a number in rad"]),
        ("surface.incline=nan", ["surface.incline", "nan"]),
        ("surface.slope=0.1", ["surface.slope", "unknown"]),
        ("surface=3", ["surface = 3", "table", "[surface]"]),
        ("surface.friction.x=1", ["surface.friction", "value, not a table"]),
        ("surface.frictoin=0.5", ["surface.frictoin", "unknown", "mean surface.friction?"]),
        ("friction=0.5", ["friction = 0.5", "unknown", "mean surface.friction?"]),
        ("surfce.friction=0.5", ["surfce.friction", "mean surface.friction?"]),
        ("finger.length.2=0.02", ["finger.length is a value, not a table; give it whole"]),
        ("nothing.like_it=1", ["nothing.like_it", "unknown", "known are drive, finger"]),
        ("solver.hcm.qqqqqqq=1", ["solver.hcm.qqqqqqq", "known are", "solver.hcm.contact_step"]),
        ("tip.restitution=1.1", ["tip.restitution", "1.1", "<= 1"]),
        ("tip.restitution=0", ["tip.restitution", ">= 0.001"]),
        ("tip.restitution=1e-200", ["tip.restitution", ">= 0.001"]),
        ("tip.normal_stiffness=-1", ["tip.normal_stiffness", "N/m", "> 0"]),
        ("drive.torques=0.1", ["drive.torques", "a list with one number per phalanx", "N m"]),
        ("drive.torques=[0.1]", ["drive.torques", "1 numbers for 3 phalanges"]),
        ("drive.torques=[]", ["drive.torques", "one number per phalanx"]),
        ("drive.reaction=1", ["drive.reaction", "true or false"]),
        ("drive.torques={}", ["drive.torques.time is missing", "under [drive.torques]"]),
        ("drive.torques='ramp'", ["drive.torques", "'ramp'", "a list with one number"]),
        table("[0]", "", "drive.torques.values is missing", "add values = ..."),
        ("drive.torques={times=[0], values=[[0, 0, 0]]}", ["drive.torques.time is missing"]),
        table("0", "[[0, 0, 0]]", "drive.torques.time = 0", "a list with one number per time in s"),
        table("[]", "[[0, 0, 0]]", "drive.torques.time = []", "one number per time"),
        table("[-1]", "[[0, 0, 0]]", "drive.torques.time", ">= 0"),
        table("[nan]", "[[0, 0, 0]]", "drive.torques.time", "nan"),
        table("['1 s']", "[[0, 0, 0]]", "drive.torques.time", "in s, without unit"),
        table("[0, 1e10]", "[[0, 0, 0], [0, 0, 0]]", "drive.torques.time", "<= 1e+09"),
        table("[1, 0]", "[[0, 0, 0], [0, 0, 0]]", "must rise, and 0 s does not"),
        table("[0, 0, 0]", "[[0, 0, 0], [0, 0, 0], [1, 1, 1]]", "two equal times are a jump"),
        table("[0, 1]", "[[0, 0, 0]]", "has 2 times for 1 rows of values"),
        table("[0]", "3", "drive.torques.values = 3", "a list of rows, one per time"),
        table("[0]", "[0, 0, 0]", "drive.torques.values", "one number per phalanx in N m"),
        table("[0]", "[[]]", "drive.torques.values", "one number per phalanx"),
        table("[0]", "[[1, 2]]", "drive.torques.values", "a row of 2 numbers for 3 phalanges"),
        table("[0]", "[[inf, 0, 0]]", "drive.torques.values", "inf"),
        table("[0]", "[[1e7, 0, 0]]", "drive.torques.values", "<= 1e+06"),
        table("[0]", "[['1 N m', 0, 0]]", "drive.torques.values", "in N m, without unit"),
        (f"drive.torques={{time={[0] * 10001}, values={[[0] * 3] * 10001}}}", ["at most 10000"]),
        (
            "solver.fem.preset=finest",
            ["solver.fem.preset", "finest", "'contact', 'fast', 'ls-dyna-like' or 'converged'"],
        ),
        ("solver.fem.penalty_factor=0", ["solver.fem.penalty_factor", "> 0"]),
        ("solver.hcm.spectral_radius=1.5", ["solver.hcm.spectral_radius", "<= 1"]),
        ("surface.friction", ["--set", "KEY=VALUE"]),
        ("=3", ["--set", "KEY=VALUE"]),
        ("surface.=3", ["--set", "KEY=VALUE"]),
        ("surface.friction=", ["--set", "KEY=VALUE"]),
    ],
)
def test_bad_values_are_refused_in_one_line(override: str, parts: list[str]) -> None:
    text = refusal(override)
    for part in parts:
        assert part in text


@pytest.mark.parametrize(
    ("overrides", "source", "parts"),
    [
        (("finger.phalanges=11", "finger.elements=2000", "surface.height=0.1"), "soft",
         ["22000 beam elements", "20000"]),
        (("surface.friction=-1", "finger.length=-1"), "soft", ["(and 1 more problem)"]),
        (("surface.height=0x" + "f" * 5000,), "soft", ["height = a number of thousands of digits"]),
        (("drive.gravity=2026-11-27",), "soft", ["drive.gravity = 2026-11-27: must be a number"]),
        ((), "sotf", ["'sotf'", "did you mean soft?", *BUILT_IN]),
    ],
    ids=["elements in all", "two problems", "hexadecimal", "a day", "unknown scene"],
)  # fmt: skip
def test_bad_scenes_are_refused_in_one_line(
    overrides: tuple[str, ...], source: str, parts: list[str]
) -> None:
    text = refusal(*overrides, source=source)
    assert all(part in text for part in parts)


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        (b"[finger\nlength = 1", ["TOML syntax error", "line 1"]),
        (b"a = 1" + b"0" * 5000, ["a number has thousands of digits"]),
        (b"a = " + b"[" * 5000 + b"]" * 5000, ["nested too deeply"]),
        (b"\xff\xfe", ["not UTF-8"]),
        (b"#" * (MAX_BYTES + 1), ["larger than"]),
        (b"", ["finger is missing", "[finger]", "length, diameter"]),
        (b"[finger]\ndiameter = 1", ["finger.length is missing", "length = ..."]),
    ],
)
def test_bad_files_are_refused_in_one_line(
    tmp_path: Path, content: bytes, parts: list[str]
) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    text = refusal(source=str(path))
    assert str(path) in text
    for part in parts:
        assert part in text


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    assert "cannot be read" in refusal(source=str(tmp_path / "none.toml"))
    folder = tmp_path / "folder.toml"
    folder.mkdir()
    assert "cannot be read" in refusal(source=str(folder))


def test_solver_keys_are_the_models_settings() -> None:
    hcm = pytest.importorskip("hcm")
    names = {key.removeprefix("solver.hcm.") for key in known_keys() if "solver.hcm" in key}
    drawn = {"frame_times"}  # postures that a figure asks for, no matter of the scene
    declared = hcm.Settings.__dataclass_fields__ | hcm.Assumptions.__dataclass_fields__
    assert names == {"accuracy", *declared} - drawn


def test_a_scene_states_settings_by_name_and_the_solver_keeps_the_other_defaults() -> None:
    import reference_fem
    from validation.models.solid_inputs import solver_settings

    stated = ["solver.fem.penalty_factor=0.4", "solver.fem.end_time=0.2", "solver.fem.threads=1"]
    penalty = load_scene("soft", [*stated, "solver.fem.contact=penalty"]).tables
    assert solver_settings(penalty) == reference_fem.Settings(
        contact="penalty", penalty_factor=0.4, end_time_s=0.2, threads=1
    )
    with pytest.raises(ValueError, match="has no effect on contact = 'impulse'"):
        solver_settings(load_scene("soft", stated).tables)
    fast = load_scene("soft", ["solver.fem.preset=fast"]).tables
    assert solver_settings(fast) == reference_fem.Settings()


def test_a_solver_is_imported_where_a_scene_states_something_for_it() -> None:
    code = """
import sys
from validation.scenes.load import load_scene
for key in (), ("solver.hcm.taps=2",), ("solver.fem.preset=fast",):
    load_scene("soft", key)
    print(sorted({"hcm", "reference_fem"} & set(sys.modules)))
"""
    assert printed("-c", code).splitlines() == ["[]", "['hcm']", "['hcm', 'reference_fem']"]
