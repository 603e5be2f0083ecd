"""Identification of the contact from static indentation, and of the torque from arrivals."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot as plt

from tests.validation.commands import Patch, Run
from tests.validation.models.test_variants import WITHOUT_TIP
from validation.compare.grid_convergence import convergence
from validation.errors import RunFailedError, UserError
from validation.identify import contact as identify
from validation.identify import contact_command, reduced_tap
from validation.models import solid_mesh
from validation.scenes.load import changed_scene, load_scene

CONTACT_RADIUS = 7e-4  # m


@pytest.fixture
def springs(monkeypatch: Patch) -> None:
    """Stand in for the static solve: k = c F^(1/3), as Hertz's, and eta^2 = 1.5."""
    import reference_fem.statics.indentation as indentation

    def indent(tip: float, area: Any, force: float) -> Any:
        stiffness = tip * force ** (1 / 3)
        return SimpleNamespace(
            stiffness_N_per_m=stiffness, eta_squared=1.5, contact_radius_m=CONTACT_RADIUS,
            indentation_m=1.25 * force / stiffness,
        )  # fmt: skip

    def tip(*arguments: Any) -> tuple[int, float]:
        return 1000, 3.3e5 * (1 + 1e5 * arguments[3] ** 2)  # order 2 in the edge

    monkeypatch.setattr(indentation, "indent", indent)
    monkeypatch.setattr(indentation, "contact_area", lambda tip: None)
    monkeypatch.setattr(identify, "_tip", tip)
    monkeypatch.setattr(identify, "yields", lambda *_: {"tip.compliance_nn": (-0.3, -0.24, -0.2)})


@pytest.mark.usefixtures("springs")
def test_identification_is_stated_at_the_reduced_models_own_peak() -> None:
    scene = load_scene("soft", ("finger.elements=5",))
    found = identify.identify_contact(scene)
    assert reduced_tap.reduced_peak(scene, found.normal_stiffness_N_per_m) == pytest.approx(
        found.force_N, rel=1e-3
    )
    assert found.stiffness.asymptotic
    assert found.eta_squared == 1.5
    assert found.mindlin_eta_squared == pytest.approx(4 / 3)
    assert found.scene_normal_stiffness_N_per_m == 0.78e6
    # Hertz at that force: k = 5 F/(4 delta).
    delta = np.interp(found.force_N, found.curve["force_N"], found.curve["hertz_indentation_m"])
    assert found.hertz_N_per_m == pytest.approx(1.25 * found.force_N / delta, rel=1e-3)


@pytest.mark.usefixtures("springs")
def test_compliances_are_those_of_the_refined_models_touch(monkeypatch: Patch) -> None:
    """It meets the surface with the lowest point of its round end, at 32.63 degrees by its own
    caution (soft, nu = 0.2); they were those of the paper's touch, at 38.2.
    """
    asked: list[float] = []
    monkeypatch.setattr(identify, "yields", lambda *given: asked.append(given[2]) or {})
    found = identify.identify_contact(load_scene("soft", ("finger.elements=5",)))
    # beams bend a little on their way
    assert 90.0 - np.degrees(asked) == pytest.approx([32.63], abs=0.2)
    assert found.round_touch_angle_deg == pytest.approx(np.degrees(asked[0]))
    assert 90.0 - found.touch_angle_deg == pytest.approx(38.2, abs=0.1)


@pytest.mark.usefixtures("springs")
def test_stiffness_is_that_of_the_touch_whose_force_it_has() -> None:
    """A finger whose round end touches 5 ms before its thin rods would: k was for 73 degrees."""
    unlike = (
        "finger.length=[0.02, 0.012, 0.015]", "finger.diameter=[0.010, 0.009, 0.008]",
        "material.youngs_modulus=[3e9, 2e9, 4e8]", "surface.height=0.024", "finger.elements=5",
        "start.angles=[0.1, 0.2, 0.3]", "solver.hcm.assumptions=refined", "tip.normal_stiffness=4e5"
    )  # fmt: skip
    found = identify.identify_contact(load_scene("soft", unlike))
    # rigid phalanges, without what the beams bend on their way
    assert found.touch_angle_deg == pytest.approx(found.round_touch_angle_deg, abs=0.5)
    # k = 5 F/(4 d) of Hertz's F = 4/3 E* sqrt(R) d^(3/2), of the last phalanx
    nu = load_scene("soft").tables.material.poisson_ratio
    slope = 4 / 3 * 4e8 / (1 - nu**2) * 0.004**0.5
    assert found.hertz_N_per_m == pytest.approx(
        1.25 * found.force_N ** (1 / 3) * slope ** (2 / 3), rel=1e-9
    )


@pytest.mark.usefixtures("springs")
def test_each_row_of_the_table_is_of_its_own_quantity() -> None:
    """The stand-in's k changes from mesh to mesh, its eta^2 does not."""
    found = identify.identify_contact(load_scene("soft", ("finger.elements=5",)))
    k, eta, indentation, *yields = contact_command.rows(found)
    assert k["uncertainty"] > 0.0 == eta["uncertainty"]
    assert contact_command.to_json(found)["eta_squared_uncertainty"] == 0.0
    assert indentation["static_indentation"] == pytest.approx(
        1.25 * found.force_N / found.normal_stiffness_N_per_m
    )
    assert found.levels[-1].contact_radius_m == CONTACT_RADIUS
    assert k["quantity"].endswith("touching at 38.2 degrees")
    assert "touching at 32.5 degrees" in yields[0]["quantity"]


@pytest.mark.usefixtures("springs")
def test_a_scene_without_a_stiffness_gets_one(
    tmp_path: Path, fingertap: Run, monkeypatch: Patch
) -> None:
    """The iteration begins elsewhere and ends, to its 1e-4, where that from the paper's k does."""
    own, few = load_scene("soft").document, ("finger.elements=5",)
    bare = {key: value for key, value in own.items() if key != "tip"}
    scenes = [changed_scene("soft", of, few, "soft") for of in (own, bare)]
    first, second = (identify.identify_contact(scene) for scene in scenes)
    assert second.scene_normal_stiffness_N_per_m is None
    assert second.force_N == pytest.approx(first.force_N, rel=2e-4)
    assert second.touch_angle_deg == pytest.approx(first.touch_angle_deg, abs=1e-9)
    path = tmp_path / "bare.toml"
    path.write_text(WITHOUT_TIP)
    said = fingertap("identify", "contact", path, "--set", *few, "--out", tmp_path).out
    assert "the scene's own" not in said.splitlines()[1]
    monkeypatch.setattr(solid_mesh, "predicted_touch", lambda *_: None)
    with pytest.raises(RunFailedError, match=r"state tip\.normal_stiffness, or lower"):
        identify.identify_contact(scenes[1])


@pytest.mark.usefixtures("springs")
def test_identify_contact_writes_table_plot_and_json(tmp_path: Path, fingertap: Run) -> None:
    arguments = ["identify", "contact", "soft", "--set", "finger.elements=5", "--out", tmp_path]
    printed = json.loads(fingertap(*arguments, "--json").out)
    folder = tmp_path / "identify"
    assert printed == json.loads((folder / "contact-soft.json").read_text())
    assert printed["normal_stiffness_N_per_m"] > 1e6
    assert len(printed["curve"]["force_N"]) == len(identify.CURVE)
    assert printed["tip_compliance"] == {"tip.compliance_nn": [-0.3, -0.24, -0.2]}
    limit = printed["tip_compliance_limit"]["tip.compliance_nn"]
    known = printed["tip_compliance_uncertainty"]["tip.compliance_nn"]
    assert limit == -0.2  # of first order in the edge: the extrapolation to -0.1 reaches too far
    row = (folder / "contact-soft.csv").read_text().splitlines()[-1]
    assert f",{limit:.10g},{known:.10g}," in row
    for ending in ("csv", "md", "tex", "png"):
        assert (folder / f"contact-soft.{ending}").stat().st_size > 100
    text = fingertap(*arguments).out
    assert all(word in text for word in ("Hertz", "Mindlin", "three meshes"))


@pytest.mark.parametrize(("order", "known"), [(1.0, 1.0 + 0.05), (2.0, 1.0), (2.5, None)])
def test_a_compliance_is_extrapolated_by_the_elements_order_alone(
    order: float, known: float | None
) -> None:
    """1 + h^p: by a higher order as by their own, which reaches less far than the finest mesh."""
    found = convergence(identify.EDGES, [1.0 + h**order for h in identify.EDGES], identify.ORDER)
    value = identify.value_to_use(found)
    if known is None:
        assert found.limit == value < found.finest
    else:
        assert value == pytest.approx(known)


def test_a_larger_height_makes_a_steeper_touch() -> None:
    """As messages about touches that are too flat say."""
    scenes = (load_scene("soft", (f"surface.height={height}",)) for height in (0.08, 0.09, 0.1))
    touches = [solid_mesh.impact_state(scene.tables, 3).angles[-1] for scene in scenes]
    assert 0.1 < touches[0] < touches[1] < touches[2] < 0.6


@pytest.mark.usefixtures("springs")
def test_a_patch_on_the_shaft_is_said(tmp_path: Path, fingertap: Run, monkeypatch: Patch) -> None:
    import reference_fem.statics.indentation as indentation

    thick = ("finger.phalanges=1", "finger.length=0.3", "finger.diameter=0.1",
             "material.youngs_modulus=1e6", "surface.height=0.06")  # fmt: skip
    given = [word for text in thick for word in ("--set", text)]
    shallow = ("identify", "contact", "soft", *given, "--out", tmp_path)
    ended = fingertap(*shallow)
    assert ended.code == 0
    assert "the patch reaches the shaft" in ended.err
    pressed = indentation.indent
    monkeypatch.setattr(
        indentation,
        "indent",
        lambda *given: SimpleNamespace(**{**vars(pressed(*given)), "eta_squared": -8.0}),
    )
    ended = fingertap(*shallow)
    assert ended.code == 2
    assert "negative" in ended.line
    assert "the patch reaches the shaft" in ended.line


def test_compliances_beyond_their_statics_are_said() -> None:
    (shaft,) = identify._yield_cautions(np.radians(20.0), 5.0)
    assert "patches up to 0.35 R, which reach the shaft at 20 degrees" in shaft
    (short,) = identify._yield_cautions(np.radians(38.0), 2.5)
    assert "nearer to the tip than 3 R" in short
    assert identify._yield_cautions(np.radians(38.0), 5.33) == ()


def test_a_force_that_k_does_not_enter_is_said() -> None:
    refined = load_scene("soft", ("solver.hcm.assumptions=refined",))
    assert identify._law_cautions(load_scene("soft")) == ()
    assert "k does not enter the reduced model" in identify._law_cautions(refined)[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [("solver.hcm.max_contact_time=1e-5", "still in contact"),
     ("solver.hcm.end_time=0.01", "it does not touch")],
)  # fmt: skip
def test_the_force_is_that_of_a_whole_tap(change: str, said: str) -> None:
    """A run that ended in contact gave 79 N for 173."""
    with pytest.raises(RunFailedError, match=said):
        reduced_tap.reduced_peak(load_scene("hard", ("finger.elements=5", change)), 1e6)


def test_a_force_that_does_not_settle_is_refused(monkeypatch: Patch) -> None:
    """Above 150 N one of two peaks is the higher, below it the other: no F has k(F)."""
    peak = lambda scene, k: 100.0 if k > 150.0 else 200.0  # noqa: E731
    monkeypatch.setattr(reduced_tap, "reduced_peak", peak)
    with pytest.raises(RunFailedError, match=r"now (100|200) N and now (100|200) N"):
        reduced_tap.stated_force(load_scene("soft"), lambda force: force, 100.0)


def test_identify_torque_prints_the_factor_and_the_times(
    monkeypatch: Patch, fingertap: Run
) -> None:
    from validation.studies.paper import torque_factor
    from validation.studies.paper.torque_factor import CaseFactor, IdentifiedTorque, TorqueFactor

    found = TorqueFactor(7.2e-5, 1e-6, {"driven-1": 0.1}, {"driven-1": 0.101})
    by_case = {
        "driven-2": CaseFactor(6.9e-5, 2e-7, 6.9e-5, 0.1),
        "driven-3": CaseFactor(None, None, 7e-5, 0.0105),
    }
    values = {"driven-1": {label: {"slip_to_stick": 3} for label in ("low", "best", "high")}}
    made = IdentifiedTorque(found, by_case, {"printed steps": found})
    monkeypatch.setattr(torque_factor, "identify_and_predict", lambda: (made, values))
    printed = json.loads(fingertap("identify", "torque", "--json").out)
    assert printed["factor_N_m_per_unit"] == 7.2e-5
    assert printed["arrival_times_s"]["driven-1"] == {"printed": 0.1, "computed": 0.101}
    assert printed["alone"]["driven-3"]["factor"] is None
    assert printed["numerics"]["printed steps"]["misfit_percent"] == pytest.approx(1.0)
    assert printed["predictions"] == values
    text = fingertap("identify", "torque").out
    for words in ("+1.00 %", "driven-2 alone: 6.9e-05", "no factor", "slip_to_stick 3, 3, 3"):
        assert words in text


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["identify", "contact", "sofd"], 2),
        (["identify", "contact", "soft", "--set", "surface.incline=20"], 2),
        (["identify", "contact", "soft", "--set", "drive.gravity=-9.8"], 1),
        (["identify"], 0),
        (["identify", "nothing"], 2),
    ],
)
def test_bad_input_ends_with_one_line(
    arguments: list[str], code: int, tmp_path: Path, fingertap: Run
) -> None:
    more = ["--out", tmp_path] if "contact" in arguments else []
    ended = fingertap(*arguments, *more)
    assert (ended.code, ended.err.count("\n")) == (code, 1 if code else 0)


def test_identify_refuses_a_folder_before_it_solves(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(UserError, match="cannot write"):
        contact_command.run_identify_contact("soft", out=blocked)


@pytest.mark.slow
def test_identified_contact_of_the_soft_finger() -> None:
    found = identify.identify_contact(load_scene("soft"))
    # A sphere that is not a half-space: the indentation is measured a radius away, which leaves
    # 2 a/(pi R) = 6 % of Hertz's out; the mesh knows k to a few percent.
    assert found.normal_stiffness_N_per_m == pytest.approx(1.06 * found.hertz_N_per_m, rel=0.04)
    assert 1.3 < found.eta_squared < 1.8
    # the closed form, and what its own statics are known to
    for key, wanted, known in (("nn", -0.15, 0.06), ("nt", 0.34, 0.05), ("tt", 1.6, 0.15)):
        assert abs(found.tip_compliance[f"tip.compliance_{key}"][-1] - wanted) < known


@pytest.mark.usefixtures("springs")
def test_a_scenes_eta_squared_is_its_normal_over_its_tangential_stiffness() -> None:
    scene = load_scene("soft", ("finger.elements=5", "tip.tangential_ratio=0.8"))
    assert identify.identify_contact(scene).scene_eta_squared == pytest.approx(1.25)


@pytest.mark.usefixtures("springs", "figures_kept")
def test_springs_are_drawn_and_told_in_the_units_of_their_axes(tmp_path: Path) -> None:
    """A line of slope k in N over um; Hertz's indentation 5 F/(4 k), and eta^-2, at that force."""
    found = identify.identify_contact(load_scene("soft", ("finger.elements=5",)))
    contact_command.draw(tmp_path / "c.png", found)
    static, hertz, own, given, at = plt.gcf().axes[0].lines
    for line, key in ((static, "indentation_m"), (hertz, "hertz_indentation_m")):
        assert line.get_xdata() == pytest.approx(1e6 * np.array(found.curve[key]))
        assert line.get_ydata() == pytest.approx(np.array(found.curve["force_N"]))
    stiffnesses = found.normal_stiffness_N_per_m, found.scene_normal_stiffness_N_per_m
    for line, stiffness in zip((own, given), stiffnesses, strict=True):
        (_, um), (_, force) = line.get_data()
        assert force / (1e-6 * um) == pytest.approx(stiffness)
    assert at.get_ydata() == pytest.approx([found.force_N] * 2)
    rows = contact_command.rows(found)
    depth = np.interp(found.force_N, found.curve["force_N"], found.curve["hertz_indentation_m"])
    assert rows[2]["theory"] == pytest.approx(depth, rel=1e-3)
    assert contact_command.to_json(found)["tangential_ratio"] == pytest.approx(1 / 1.5)


def test_a_tangential_compliance_is_over_the_touchs_cosine(monkeypatch: Patch) -> None:
    """At 60 degrees it is twice the statics' own; the others are those."""
    import reference_fem.statics.yielding as yielding

    statics = SimpleNamespace(nn=-0.3, nt=0.4, tt=0.8)
    monkeypatch.setattr(yielding, "tip_yield", lambda *_: statics)
    monkeypatch.setattr(identify, "_end", lambda *_: None)
    found = identify.yields(load_scene("soft"), None, np.radians(60.0), (0.1,))
    assert [of for (of,) in found.values()] == pytest.approx([-0.3, 0.4, 1.6])
    assert [key.rpartition("_")[2] for key in found] == ["nn", "nt", "tt"]
