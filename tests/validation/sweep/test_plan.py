"""Plans and points: what is refused in one line, and where the points lie."""

import os
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from scipy import stats

from tests.validation.commands import Run
from tests.validation.sweep.plans import PLAN, written
from validation.errors import UserError
from validation.scenes.load import load_scene, parse_value
from validation.sweep.axis import Axis
from validation.sweep.plan import assignment, lists_replaced, read_plan
from validation.sweep.points import points_of, values_of

UNLIKE = """scene = "own.toml"
models = ["hcm"]
[points]
number = 4
[vary]
"finger.length" = { low = 0.02, high = 0.04 }
"material.density" = { low = 900, high = 1100 }
"start.angles" = { values = [[0.1, 0.2, 0.3]] }
"""
VARY = '[vary]\n"surface.friction" = '
HEAD = 'scene = "soft"\nmodels = ["hcm"]\n[points]\nnumber = 4\n'

TORQUES = '"drive.torques" = { values = [[0]] }\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("models = [", "TOML syntax error"),
        (HEAD, "vary is missing"),
        ('models = ["hcm"]', "scene is missing"),
        ('scene = "soft"', "models is missing"),
        (PLAN.replace('"soft"', '"sfot"'), "did you mean soft?"),
        (PLAN.replace('["hcm"]', "[]"), "models = []"),
        (PLAN.replace('["hcm"]', '["hcn"]'), "models: 'hcn': unknown; did you mean hcm?"),
        (PLAN.replace('["hcm"]', '["hcm", "hcm"]'), "appears twice; give each a variant"),
        (PLAN.replace('["hcm"]', "[3]"), "must be names of models or tables"),
        (PLAN.replace('["hcm"]', '[{ model = "hcm", sets = {} }]'), "must be names of models"),
        (PLAN.replace('["hcm"]', '[{ model = "hcm", set = { "tip.k" = 1 } }]'), "unknown key"),
        (
            PLAN.replace('["hcm"]', '[{ model = "hcm", set = { "surface.friction" = 1 } }]'),
            "is varied too",
        ),
        ("point = 3\n" + PLAN, "unknown key; known are scene, models, set, points, vary"),
        (PLAN.replace("number = 4", "number = 0"), ">= 1"),
        (PLAN.replace("number = 4", "number = 2.5"), "whole number"),
        (PLAN.replace("number = 4", "number = 100000000"), "<= 1e+07"),
        (PLAN.replace("number = 4", ""), "points.number is missing"),
        (PLAN.replace("number = 4", "nr = 4"), "known are kind, number, seed, file, columns"),
        (PLAN.replace("number = 4", "count = 4"), "points.count = 4: belongs to an axis"),
        (PLAN.replace("number = 4", 'kind = "halton"'), "must be"),
        (PLAN.replace("number = 4", 'number = 4\nkind = "grid"'), "follows from the grid"),
        (PLAN.replace("number = 4", "number = 4\nseed = -1"), "points.seed = -1"),
        (PLAN.replace("number = 4", 'number = 4\nfile = "p.csv"'), "write kind = 'file'"),
        (PLAN.replace("number = 4", 'kind = "file"'), "points.file is missing"),
        (PLAN.replace("surface.height", "surface.heigth"), "did you mean surface.height?"),
        (PLAN.replace('"surface.height" = 0.03', '"surface.height" = -1'), "surface.height = -1"),
        (PLAN.replace("surface.height", "surface.friction"), "is varied too"),
        (
            HEAD + "[vary]\n" + TORQUES + TORQUES.replace("torques", "torques.time"),
            "vary.drive.torques.time: drive.torques gives it a value too",
        ),
        (
            HEAD + f'[set]\n"drive.torques.time" = [0]\n[vary]\n{TORQUES}',
            "set.drive.torques.time is varied too, by vary.drive.torques",
        ),
        (
            HEAD
            + '[set]\n"drive.torques" = [0]\n"drive.torques.time" = [0]\n'
            + VARY
            + "{ values = [1] }",
            "set.drive.torques.time: drive.torques gives it",
        ),
        (
            HEAD.replace('"hcm"', '{ model = "hcm", set = { "drive.torques.values" = [[0]] } }')
            + f"[vary]\n{TORQUES}",
            "models.set.drive.torques.values is varied too, by vary.drive.torques",
        ),
        (
            HEAD + "[vary]\n" + TORQUES.replace("[[0]]", "[{ time = [0.0] }]"),
            "vary.drive.torques.values.values is missing",
        ),
        (
            PLAN.replace("surface.friction", "finger.length[2]"),
            "unknown key of a scene; finger.length has no parts: a list is given whole",
        ),
        (PLAN.replace("surface.friction", "surface.fricton"), "did you mean surface.friction?"),
        (HEAD + VARY + "0.5", "vary.surface.friction"),
        (HEAD + VARY + "{ low = 0.1 }", "high is missing"),
        (HEAD + VARY + "{ values = [0.5, 1.0], count = 9 }", "count: has no meaning with values"),
        (
            HEAD + VARY + "{ low = 0.1, high = 0.5, count = 9 }",
            "count: is for a grid; leave it out",
        ),
        (HEAD + VARY + "{ low = 0.5, high = 0.1 }", "must be below high = 0.1"),
        (HEAD + VARY + "{ low = 0.5, high = 0.5 }", "must be below high"),
        (HEAD + VARY + "{ low = -1.0, high = 0.5 }", ">= 0"),
        (HEAD + VARY + "{ low = 0.0, high = 1e6 }", "<= 100"),
        (HEAD + VARY + "{ low = nan, high = 1.0 }", "must be a number"),
        (HEAD + VARY + "{ low = 0.0, high = 1.0, log = true }", "above 0 where log = true"),
        (HEAD + VARY + '{ low = "0", high = 1.0 }', "vary.surface.friction.low"),
        (HEAD + VARY + "{ from = 0.0, high = 1.0 }", "known are low, high, log, values"),
        (HEAD + VARY + "{ low = 0.0, high = 1.0, values = [1] }", "give one of the three"),
        (HEAD + VARY + "{ values = [1], log = true }", "log: has no meaning with values"),
        (
            HEAD + VARY + '{ distribution = "norm", log = true }',
            "log: has no meaning with distribution",
        ),
        (HEAD + VARY + "{ low = 0, high = 1, parameters = {} }", "parameters: has no meaning"),
        (
            PLAN.replace("number = 4", 'number = 4\ncolumns = ["a"]'),
            "points.columns: are for a file",
        ),
        (HEAD + "[vary]\nsurface.friction = { low = 0, high = 1 }", 'in quotes, "surface.NAME"'),
        (PLAN.replace('"surface.height" =', "surface.height ="), 'in quotes, "surface.NAME"'),
        (
            PLAN.replace('["hcm"]', '[{ model = "hcm", set = { "finger.elements" = "a" } }]'),
            "models.set.finger.elements",
        ),
        (HEAD + VARY + "{ values = [] }", "at least one value"),
        (
            PLAN.replace('["hcm"]', '[{ model = "hcm", set = { "solver.hcm.flight" = "rigd" } }]'),
            "models.set.solver.hcm.flight = 'rigd': must be 'elastic', 'modal' or 'rigid'",
        ),
        (
            HEAD + '[vary]\n"solver.hcm.flight" = { values = [1979-05-27] }',
            "must be 'elastic', 'modal' or",
        ),
        (HEAD + '[vary]\n"solver.hcm.hertz" = { values = [2] }', "= 2: must be true or false"),
        (
            PLAN.replace("[set]", '[set]\n"solver.hcm.flight" = 1979-05-27'),
            "= '1979-05-27': must be 'elastic'",
        ),
        (HEAD + VARY + "{ values = [0.1, -3] }", "vary.surface.friction.values = -3"),
        (HEAD + VARY + '{ distribution = "gaussian" }', "continuous distribution of scipy.stats"),
        (
            HEAD + VARY + '{ distribution = "norm", parameters = { mean = 1 } }',
            "norm takes loc, scale",
        ),
        (HEAD + VARY + '{ distribution = "beta", parameters = { a = 1 } }', "beta takes a, b, loc"),
        (HEAD + VARY + '{ distribution = "norm", parameters = { scale = -1 } }', "no distribution"),
        (HEAD + VARY + '{ distribution = "norm", parameters = { scale = 0 } }', "a scale, say"),
        (HEAD + '[vary]\n"finger.phalanges" = { low = 1, high = 4 }', "give its values as a list"),
        (HEAD + '[vary]\n"drive.torques" = { low = 1, high = 4 }', "give its values as a list"),
        (HEAD + '[vary]\n"drive.reaction" = { low = 0, high = 1 }', "give its values as a list"),
        (PLAN.replace("number = 4", 'kind = "grid"\nseed = 1'), "points.seed: nothing is random"),
        (PLAN.replace('["hcm"]', r'[{ model = "hcm", variant = "a\u0000b" }]'), "a null byte"),
    ],
)
def test_a_bad_plan_is_refused_in_one_line(
    text: str, said: str, tmp_path: Path, fingertap: Run
) -> None:
    path = written(tmp_path, text)
    assert said in fingertap("sweep", path, "--out", tmp_path).refusal
    assert not (tmp_path / "sweep" / "plan" / "results.jsonl").exists()


COARSE = '"hcm", { model = "hcm", variant = "coarse", set = { "finger.elements" = 5 } }'
FILE = 'scene = "soft"\nmodels = ["hcm"]\n[points]\nkind = "file"\nfile = "p.csv"\n'


@pytest.mark.parametrize(
    ("plan", "content", "said"),
    [
        (FILE, None, "cannot be read"),
        (FILE, "", "has no points"),
        (FILE, "surface.friction\n", "has no points"),
        (FILE, "surface.fricton\n1\n", "did you mean surface.friction?"),
        (FILE, "surface.friction,surface.height\n0.1\n", "line 2 has 1 values for 2 columns"),
        (FILE, "surface.friction;surface.height\n0.1;0.1\n", "line 1 has ';': must have commas"),
        (FILE, "surface.friction\n-0.1\n", "line 2: surface.friction = -0.1: must be a number"),
        (FILE, "surface.friction\nrough\n", "surface.friction = 'rough'"),
        (FILE, "surface.friction,surface.height\n\n0.1,\n", "line 3: surface.height is empty"),
        (FILE, "surface.friction\n0.5 # 0.9\n", "surface.friction = '0.5 # 0.9': must be a number"),
        (FILE, "surface.friction,surface.friction\n0.1,0.2\n", "appears twice"),
        (FILE + 'columns = ["surface.height"]\n', "surface.friction\n1\n", "is missing: it has"),
        (FILE + '[set]\n"surface.friction" = 0.5\n', "surface.friction\n1\n", "set in the plan"),
        (FILE.replace('"hcm"', COARSE), "finger.elements\n9\n", "set in the plan too"),
        (FILE.replace("p.csv", "p\\u0000.csv"), None, "cannot be read ("),
        (
            FILE,
            "drive.torques,drive.torques.time\n[0],[0]\n",
            "column drive.torques.time: drive.torques gives it a value too",
        ),
        (
            FILE + '[set]\n"drive.torques.time" = [0]\n"drive.torques.values" = [[0, 0, 0]]\n',
            "drive.torques\n[0]\n",
            "is set in the plan too, by drive.torques.time",
        ),
        (FILE, 'drive.torques\n"{ time = [0] }"\n', "line 2: drive.torques.values is missing"),
        (FILE + "number = 4\n", "surface.friction\n1\n", "follows from the file"),
        (FILE + VARY + "{ low = 0.0, high = 1.0 }", "surface.friction\n1\n", "leave it out"),
    ],
)
def test_a_bad_file_of_points_is_refused_in_one_line(
    plan: str, content: str | None, said: str, tmp_path: Path, fingertap: Run
) -> None:
    if content is not None:
        (tmp_path / "p.csv").write_text(content, encoding="utf-8")
    assert said in fingertap("sweep", written(tmp_path, plan), "--out", tmp_path).refusal


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--workers", "0"), "must be 1 or more"),
        (("--workers", "2", "--dask", "tcp://127.0.0.1:1"), "leave one"),
    ],
)
def test_bad_options_are_refused(
    options: tuple[str, ...], said: str, tmp_path: Path, fingertap: Run
) -> None:
    assert said in fingertap("sweep", written(tmp_path), *options, "--out", tmp_path).refusal


def test_a_file_has_points_of_any_kind(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(
        "id,start.angles,finger.phalanges,solver.hcm.flight\n"
        '1, "[0.1, 0.2]", 2, rigid\n2, .5, 1, elastic\n'
    )
    columns = 'columns = ["start.angles", "finger.phalanges", "solver.hcm.flight"]\n'
    points = points_of(read_plan(written(tmp_path, FILE + columns)))
    assert len(points) == 2
    assert points.overrides(0) == (
        "start.angles=[0.1, 0.2]", "finger.phalanges=2", 'solver.hcm.flight="rigid"',
    )  # fmt: skip
    assert points.overrides(1)[0] == "start.angles=0.5"


def of(tmp_path: Path, points: str) -> np.ndarray:
    """Points of the two ranges, as shares of them."""
    table = points_of(read_plan(written(tmp_path, PLAN.replace("number = 4", points)))).columns
    friction, modulus = map(np.array, table.values())
    return np.column_stack([friction / 1.2, np.log(modulus / 1e9) / np.log(100.0)])


def test_more_points_of_a_sequence_begin_with_the_fewer(tmp_path: Path) -> None:
    for kind in ("sobol", "random"):
        few, many = (of(tmp_path, f'number = {n}\nkind = "{kind}"') for n in (5, 64))
        assert np.array_equal(few, many[:5])
        assert not np.array_equal(many, of(tmp_path, f'number = 64\nkind = "{kind}"\nseed = 1'))


def test_points_fill_their_ranges_evenly(tmp_path: Path) -> None:
    """A Latin hypercube and 2^m Sobol points put one point into each of n slices of every side."""
    for kind in ("sobol", "latin-hypercube"):
        shares = of(tmp_path, f'number = 16\nkind = "{kind}"')
        assert np.array_equal(np.sort(np.floor(16 * shares), axis=0).T, [np.arange(16)] * 2)


def test_a_grid_has_all_combinations(tmp_path: Path) -> None:
    shares = of(tmp_path, 'kind = "grid"')
    five = np.linspace(0.0, 1.0, 5)
    assert shares == pytest.approx(np.array([(a, b) for a in five for b in five]), abs=1e-12)


def test_a_distributions_points_are_its_quantiles() -> None:
    axis = Axis(distribution="norm", parameters={"loc": 2.0, "scale": 0.5})
    shares = np.array([0.0, 0.25, 0.5, 1.0])
    values = values_of(axis, shares)
    assert values[1:3] == pytest.approx(stats.norm(2.0, 0.5).ppf(shares[1:3]), rel=1e-12)
    assert np.isfinite(values).all()
    assert values_of(Axis(values=["a", "b"]), np.array([0.0, 0.49, 0.5, 1.0])) == [*"aabb"]


def test_the_ends_of_a_range_are_as_written() -> None:
    """The power of a rounded ratio would leave a bound of the scene by its last bit."""
    ends = np.array([0.0, 1.0])
    for low, high in ((1e7, 1e11), (0.3, 0.49), (1e-9, 2.0)):
        for log in (False, True):
            assert values_of(Axis(low=low, high=high, log=log), ends) == [low, high]


def test_a_plans_name_can_be_kept(tmp_path: Path) -> None:
    """HDF5 refused it after all scenes had been solved."""
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/pl\xe9.toml"))
    path.write_text(PLAN)
    assert read_plan(path).name.encode() == rb"pl\udce9"


def test_a_plans_scene_lies_beside_it(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text("[finger]\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"own\.toml.*is missing"):
        read_plan(written(tmp_path, PLAN.replace('"soft"', '"own.toml"')))


def test_torques_over_time_vary_by_their_columns(tmp_path: Path) -> None:
    vary = '[vary]\n"drive.torques.time" = { values = [[0.0, 0.1], [0.0, 0.2]] }'
    points = points_of(read_plan(written(tmp_path, HEAD + vary)))
    assert points.overrides(0)[0].startswith("drive.torques.time=[0.0, 0.")
    with pytest.raises(UserError, match=r"drive\.torques\.time\.values = \[-1\]: must be a list"):
        read_plan(written(tmp_path, HEAD + vary.replace("[0.0, 0.1]", "[-1]")))


def test_assignments_are_toml() -> None:
    assert assignment("a.b", 1e-7) == "a.b=1e-07"
    assert assignment("a.b", [0.1, True, "µ"]) == 'a.b=[0.1, true, "µ"]'
    table = {"time": [0.0, 0.1], "values": [[1.0], [2]]}
    assert parse_value(assignment("a", table).removeprefix("a="), "a") == table


def test_a_grid_over_a_distribution_takes_the_middles_of_equal_shares(tmp_path: Path) -> None:
    """A distribution's ends may be infinite; a range's are its own."""
    axes = (
        '[vary]\n"surface.friction" = { distribution = "uniform", parameters = { scale = 0.6 },'
        ' count = 3 }\n"tip.restitution" = { low = 0.4, high = 0.8, count = 2 }\n'
    )
    text = PLAN.partition("[vary]")[0].replace("number = 4", 'kind = "grid"') + axes
    found = points_of(read_plan(written(tmp_path, text))).columns
    assert sorted(set(found["surface.friction"])) == pytest.approx([0.1, 0.3, 0.5])
    assert sorted(set(found["tip.restitution"])) == [0.4, 0.8]


def test_a_list_that_a_number_replaces_is_told(tmp_path: Path) -> None:
    """Fingers of three equal phalanges were solved for one whose phalanges differ."""
    lists = ("finger.length=[0.06, 0.04, 0.04]", "material.density=[1e3, 1e3, 1e3]")
    own = tomli_w.dumps(load_scene("soft", lists).document)
    (tmp_path / "own.toml").write_text(own, encoding="utf-8")

    def replaced(text: str) -> list[str]:
        plan = read_plan(written(tmp_path, text))
        return lists_replaced(plan, points_of(plan).columns)

    (told,) = replaced(UNLIKE)
    assert told.startswith("finger.length varies as one value of all phalanges, for the scene's")
    whole = UNLIKE.replace("{ low = 0.02, high = 0.04 }", "{ values = [[0.06, 0.04, 0.06]] }")
    assert replaced(whole) == []
