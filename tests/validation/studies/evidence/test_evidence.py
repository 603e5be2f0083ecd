"""Evidence from outside: the theories beside it, what a piece's rows become, and the page."""

import importlib.util
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import pyplot as plt

import reference_fem
from tests.validation.commands import Patch, Run, asking
from validation.harness.figures import GREEN, ORANGE, panels
from validation.harness.store import Store
from validation.models.adapter import Progress
from validation.studies.evidence import (
    ball,
    command,
    hertz_ball,
    measured_ball,
    oblique_ball,
    pendulum,
    report,
    taps,
)
from validation.studies.evidence.ball import (
    COARSER,
    Bounce,
    by_elements,
    by_reduced_model,
    hertz,
)
from validation.studies.evidence.command import PIECES, look
from validation.studies.evidence.mindlin import spin
from validation.studies.evidence.report import Shown, difference_text, tally, word, write_evidence
from validation.studies.evidence.rows import LEVELS, EvidenceRow, Piece
from validation.studies.evidence.static_beam import ClampedBeam, princeton_rows

ROW = EvidenceRow("a number", "m", "hcm", 2.0, 0.03, 2.1, 0.04, "as told")

TAP = taps.SpringTap("soft", 300.0, 0.0)
ERRORS = dict.fromkeys(taps.JUDGED, 1.1)
OWN = taps.ReferenceTap((0.0, 1e-6, 2e-6, 3e-6, 4e-6), (0.0, 8.0, 11.0, 4.0, 0.0), ERRORS,
               2e-6, (2000, 3000), (1.0, 3.0), (0,), ())  # fmt: skip
STOPPED = taps.CalculixTap(TAP, "CalculiX 1", "today", "here", 60.0, 1e-6, (0.0, 1e-6, 2e-6, 3e-6),
                       (0.0, 8.0, 10.0, 4.0), 2e-6, (1000, 3000))  # fmt: skip


def quiet(share: float, text: str) -> None:
    """Progress that nobody watches."""


def figure(path: Path) -> None:
    with panels(path, 1):
        pass


def piece(solve: Callable[[Progress, Store], list[EvidenceRow]], **changes: object) -> Piece:
    """One of this module's own."""
    plain = Piece("own", "One", "tap", "somebody", "a problem", (__name__,), solve)
    return replace(plain, modules=("validation.studies.evidence.rows",), **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("inertia", [0.4, 0.41])
def test_a_ball_slides_throughout_from_mindlins_angle_on(poisson: float, inertia: float) -> None:
    # Maw, Barber and Fawcett 1976: no part of the patch sticks where psi >= 4 chi - 1
    least = 2 * (1 + 1 / inertia) - (2 - poisson) / (2 * (1 - poisson))
    whole = 2 / inertia  # J_t = mu J_n = 2 mu m v_n
    assert spin(1.02 * least, poisson, inertia) == pytest.approx(whole, rel=1e-6)
    assert spin(0.9 * least, poisson, inertia) < 0.998 * whole


def test_hcms_ball_is_mindlins_where_its_patch_is_small() -> None:
    for x in (0.5, 1.5, 4.0):
        # 22 springs under the patch: 2e-3
        assert by_reduced_model(1e-5, x, 0.3).spin == pytest.approx(spin(x, 0.3), rel=2e-3)


def test_a_mesh_error_of_first_order_is_found(monkeypatch: Patch) -> None:
    depth = np.linspace(0.0, 6e-4, 4001)  # over R

    def pressed(edge: float) -> Bounce:  # force too large by the share edge/sqrt(depth)
        force = depth**1.5 * (1.0 + edge / np.sqrt(np.maximum(depth, 1e-9)))
        return Bounce(depth, force, depth, 0.0, 0.0)

    meshes = pressed(1e-4), pressed(1e-4 * COARSER)
    monkeypatch.setattr(hertz_ball, "bounces", lambda *given: meshes)
    for row in hertz_ball.rows("fem3d", True, quiet, Store(None)):
        place = float(row.quantity.split()[-2]) * 1e-6 / hertz_ball.RADIUS
        assert row.ours_error / row.ours == pytest.approx(1e-4 / place**0.5, rel=0.02)


def test_an_approach_that_our_ball_does_not_reach_has_no_number(monkeypatch: Patch) -> None:
    """The last published one was given our largest force, and said to agree."""
    monkeypatch.setattr(hertz_ball, "LOADING", ((40.98, 8360.0), (49.99, 11326.0)))
    reached, beyond = hertz_ball.rows("hcm", True, quiet, Store(None))
    assert reached.ours == pytest.approx(8509, rel=1e-3)
    assert (beyond.ours, word(beyond)) == (None, "cannot tell")
    assert beyond.remark.endswith("; not reached: ours turns at 49.72 um")


def test_hcms_ball_is_hertzs() -> None:
    bounce, (depth, duration) = by_reduced_model(1e-3, 0.0, 0.3), hertz(1e-3, 0.3)
    assert bounce.approach.max() == pytest.approx(depth, rel=1e-6)
    assert bounce.time[-1] == pytest.approx(duration, rel=5e-4)  # two of its steps
    # an elastic tap turns the momentum round
    impulse = np.trapezoid(bounce.force, bounce.time)
    assert impulse == pytest.approx(2 * 4 / 3 * math.pi * 1e-3, rel=1e-5)


def test_a_beam_under_a_small_load_bends_as_euler_says() -> None:
    beam = ClampedBeam(2.0, 1e6, 800.0, force=1e-3)
    sag = -1e-3 * 2.0**3 / (3 * 800.0)
    for tip in (beam.by_elements(4), beam.by_energy(own=True), beam.by_energy(own=False)):
        assert tip[1] == pytest.approx(sag, rel=1e-5)


def test_exudyns_energy_gives_exudyns_number() -> None:
    stated = np.array([-0.508537304326, -1.207239854550])
    beam = ClampedBeam(2.0, 2.07e9, 1.725e6, force=3 * 1.725e6 / 4)
    np.testing.assert_allclose(beam.by_energy(own=False), stated, atol=1e-11)
    # 32 elements: 1.3e-7 m, falling with the fourth power
    np.testing.assert_allclose(beam.by_elements(32), beam.by_energy(own=True), atol=2e-7)
    assert np.abs(beam.by_energy(own=True) - stated).max() > 7e-4


def test_what_is_predicted_of_exudyns_beams_is_found() -> None:
    for one in PIECES[:2]:
        words = [word(row) for row in one.solve(quiet, Store(None))]
        assert words == ["differs", "agrees"] * (len(words) // 2)


def test_the_princeton_beam_is_ansys_beam_but_for_shear() -> None:
    flat, edge = np.split(np.array([
        (row.ours - row.outside) / row.outside
        for row in princeton_rows(quiet, Store(None)) if row.quantity.endswith("beams")
    ]), 2)  # fmt: skip
    assert np.abs(flat).max() < 2e-4  # of which their number is known
    # 3 E I over k G A L^2 of its sag
    thick, length, poisson = 12.3777e-3, 0.508, 0.31
    shear = 2 * (1 + poisson) * thick**2 / (4 * 5 / 6 * length**2)
    np.testing.assert_allclose(edge, -shear, atol=2e-4)


def test_a_ball_whose_angles_are_hcms_is_told_to_agree(monkeypatch: Patch) -> None:
    angle = math.radians(30.0)
    y = measured_ball.by_hcm(angle)
    leaves = measured_ball.leaving_of(angle, y)
    assert measured_ball.spin_of(angle, math.radians(leaves)) == pytest.approx(y)
    # all slips: friction's impulse is mu times the normal one, (1 + e) m v_n, on an arm that is
    # shorter than R by the approach, 0.4 % of it
    steep = math.radians(60.0)
    whole = 2.5 * (1 + measured_ball.RESTITUTION)
    assert measured_ball.by_hcm(steep) == pytest.approx(whole, rel=5e-3)
    monkeypatch.setattr(measured_ball, "POINTS", ((30.0, leaves), (60.0, 48.0)))
    same, other = measured_ball.rows(quiet, Store(None))
    assert same.ours == pytest.approx(same.outside)
    assert other.ours == pytest.approx(measured_ball.leaving_of(steep, whole), abs=0.1)
    # an angle misread by the readings' share of the axis, at full slip
    slope = math.radians(1.2) * measured_ball.RESTITUTION / (1.4 * measured_ball.FRICTION)
    assert same.outside_error > slope


def test_a_verdict_in_words() -> None:
    assert difference_text(ROW) == "+5.0 ± 2.5 %: differs"
    assert difference_text(replace(ROW, ours=2.02)) == "+1.0 ± 2.5 %: agrees"
    assert difference_text(replace(ROW, outside_error=math.inf)) == "cannot tell"
    assert difference_text(replace(ROW, outside_error=0.4)) == "+5.0 ± 20 %: cannot tell"
    assert difference_text(replace(ROW, outside_error=4.0)) == "+5.0 ± 200 %: cannot tell"
    same = replace(ROW, ours=1.99999)
    assert difference_text(same) == "+0.0 ± 2.5 %: agrees"
    # 1.04 % is more than 1.00 %, and both are 1.0
    near = replace(ROW, outside_error=0.02, ours=2.0208, ours_error=0.0)
    assert difference_text(near) == "+1.04 ± 1.00 %: differs"


def test_rows_are_kept_and_read_back(tmp_path: Path) -> None:
    asked = []

    def solve(progress: Progress, store: Store) -> list[EvidenceRow]:
        asked.append(1)
        return [ROW]

    one, store = piece(solve), Store(tmp_path)
    assert look(one, False, store, quiet).rows == look(one, True, store, quiet).rows == (ROW,)
    assert len(asked) == 1
    look(one, False, Store(tmp_path, fresh=True), quiet)
    data = tmp_path / "data"
    data.write_text("other", encoding="utf-8")
    look(replace(one, data=(data,)), False, store, quiet)
    assert len(asked) == 3


def test_what_is_absent_left_out_or_failed_says_so(tmp_path: Path) -> None:
    def fail(progress: Progress, store: Store) -> list[EvidenceRow]:
        raise ArithmeticError("no equilibrium")

    store = Store(tmp_path)
    for quick, slow in ((False, False), (False, True), (True, False)):
        assert look(piece(fail, slow=slow), quick, store, quiet).why == "failed: no equilibrium"
    assert look(piece(fail, slow=True), True, store, quiet).why == "left out by --quick"
    gone = piece(fail, absent=lambda: "X is not installed: pip install x")
    assert look(gone, False, store, quiet).why == "X is not installed: pip install x"


def test_pyelastica_is_named_where_it_is_absent(monkeypatch: Patch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert "pip install 'fingertap[bench]'" in pendulum.absent()


def test_the_command_leaves_a_page_and_a_table(
    tmp_path: Path, monkeypatch: Patch, fingertap: Run
) -> None:
    def solve(progress: Progress, store: Store) -> list[EvidenceRow]:
        absent = replace(ROW, ours=None, ours_error=None)
        return [ROW, replace(ROW, ours=2.0, unit="mN s"), absent]

    pieces = piece(solve), piece(solve, name="other", slow=True)
    monkeypatch.setattr(command, "PIECES", pieces)
    for name in ("draw_forces", "draw_field"):
        monkeypatch.setattr(report, name, lambda path, *given: figure(path))
    ended = fingertap("evidence", "--quick", "--out", tmp_path)
    assert ended.code == 0
    told = [" ".join(line.split()) for line in ended.out.splitlines()]
    assert "a number hcm 2.00 ± 0.03 2.10 ± 0.04 m +5.0 ± 2.5 %: differs" in told
    assert "a number hcm 2.00 ± 0.03 2.00 ± 0.04 mN s +0.0 ± 2.5 %: agrees" in told
    assert "a number hcm 2.00 ± 0.03 – m cannot tell; as told" in told
    page = (tmp_path / "evidence" / "index.html").read_text(encoding="utf-8")
    assert "<b>1 agree</b>" in page
    assert "<b>1 differ</b>" in page
    assert "left out by --quick" in page
    assert "+5.0 ± 2.5 %: differs" in page
    assert "http" not in page.replace("http://www.w3.org", "")
    table = (tmp_path / "evidence" / "evidence.csv").read_text(encoding="utf-8").splitlines()
    assert len(table) == 4
    assert table[1].startswith("tap,own,a number,m,hcm,2,0.03,2.1,0.04,5,2.5,differs,as told")


def test_pieces_have_names_levels_sources_and_reasons() -> None:
    assert len({one.name for one in PIECES}) == len(PIECES)
    assert [LEVELS.index(one.level) for one in PIECES] == sorted(
        LEVELS.index(one.level) for one in PIECES
    )
    assert all(one.source and one.what for one in PIECES)
    # a ball by finite elements takes minutes
    assert all(one.slow for one in PIECES if one.name.endswith(("fem3d", "limit")))


def test_calculixs_taps_are_kept_with_date_and_machine() -> None:
    kept = taps.kept_taps()
    assert set(taps.TAPS.values()) <= set(kept)
    for one in kept.values():
        force, time = np.array(one.normal_force_N), np.array(one.time_s)
        assert force[0] == 0.0
        assert force[-1] < force.max()  # past its peak at least
        assert (np.diff(time) > 0).all()
        assert one.program.startswith("CalculiX")
        assert one.date
        assert one.machine


def test_a_field_beside_another() -> None:
    size, ours, apart = taps.fields(STOPPED, OWN)
    # volumes 1 and 3: sqrt((1 + 3 * 9)/4), sqrt((4 + 3 * 9)/4), of 1 in a quarter of the body
    assert (size, ours) == pytest.approx((1e6 * 7**0.5, 1e6 * 7.75**0.5))
    assert apart == pytest.approx(0.5 / 7**0.5)


def test_a_tap_that_was_stopped_has_its_peak_and_its_field(monkeypatch: Patch) -> None:
    monkeypatch.setattr(taps, "calculix_tap", lambda *given: STOPPED)
    monkeypatch.setattr(taps, "reference_tap", lambda *given: OWN)
    peak, field = taps.rows(TAP, quiet, Store(None))
    assert (peak.outside, peak.ours, peak.ours_error) == (10.0, 11.0, 1.1)
    assert field.ours_error == pytest.approx(0.1 * field.ours)
    assert "differ by 19 % of it" in field.remark
    assert "CalculiX was stopped at 3 us, still in contact at 4 N" in peak.remark
    ended = replace(
        STOPPED, time_s=(*STOPPED.time_s, 4e-6), normal_force_N=(0.0, 8.0, 10.0, 4.0, 0.0)
    )
    monkeypatch.setattr(taps, "calculix_tap", lambda *given: ended)
    peak, impulse, *_, whole = taps.rows(TAP, quiet, Store(None))
    assert "stopped" not in peak.remark
    assert (impulse.outside, impulse.unit) == (pytest.approx(0.022), "mN s")
    assert (whole.outside, whole.unit) == (pytest.approx(7**0.5), "MPa")


def test_soft_springs_are_given_to_both_programs(monkeypatch: Patch) -> None:
    soft = replace(OWN, normal_force_N=(0.0, 4.0, 5.5, 2.0, 0.0), errors=dict.fromkeys(ERRORS, 5.0))
    monkeypatch.setattr(taps, "calculix_tap", lambda *given: STOPPED)
    monkeypatch.setattr(
        taps, "reference_tap", lambda tap, _: OWN if tap.factor == taps.STIFF else soft
    )
    peak, _ = taps.rows(replace(TAP, factor=1.0), quiet, Store(None))
    # a tenth of either, as on stiff springs, and not the 5 N that springs may change
    assert (peak.ours, peak.ours_error, peak.outside_error) == pytest.approx((5.5, 0.55, 1.0))


@pytest.mark.parametrize("solve", [
    lambda: taps.prepared("soft", 1.0, 0.0), lambda: ball.by_elements(1e-3, 0.0, 0.3),
])  # fmt: skip
def test_an_interrupt_is_no_failure_of_a_piece(
    solve: Callable[[], object], monkeypatch: Patch
) -> None:
    """It was kept as one: the page was written with a hole, and the command ended with 0."""
    stopped = SimpleNamespace(status=reference_fem.Status.INTERRUPTED, message="stopped")
    monkeypatch.setattr(reference_fem, "simulate", lambda *_, **__: stopped)
    monkeypatch.setattr(ball, "explicit_tap", lambda *_: stopped)
    with pytest.raises(KeyboardInterrupt):
        solve()


def test_the_page_counts_each_pieces_verdicts_and_puts_remarks_below(tmp_path: Path) -> None:
    for name in ("taps", "tap-soft", "tap-hard"):
        figure(tmp_path / f"{name}.png")
    rows = (ROW, replace(ROW, ours=3.0, remark=""), replace(ROW, ours=4.0))
    shown = [
        Shown(piece(lambda *given: []), rows),
        Shown(piece(lambda *given: [], level="beam"), ()),
    ]
    assert tally(shown) == [{"how many": "One", "agrees": None, "differs": 3, "cannot tell": None}]
    write_evidence(tmp_path, shown)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count('colspan="6"><div>as told</div>') == page.count('class="remark"') == 2
    assert re.search(r">One</td><td[^>]*>–</td><td[^>]*>3</td>", page)


def test_a_tap_that_fails_leaves_the_others_their_figures(
    tmp_path: Path, monkeypatch: Patch, fingertap: Run
) -> None:
    def fail(progress: Progress, store: Store) -> list[EvidenceRow]:
        raise ArithmeticError("no equilibrium")

    hard = piece(lambda *given: [ROW], name="tap-hard")
    monkeypatch.setattr(command, "PIECES", [piece(fail, name="tap-soft"), hard])
    drawn = list[object]()
    monkeypatch.setattr(
        report, "draw_forces", lambda path, of, store: drawn.extend(of) or figure(path)
    )
    monkeypatch.setattr(
        report, "draw_field", lambda path, of, store: drawn.append(of) or figure(path)
    )
    ended = fingertap("evidence", "--out", tmp_path)
    assert (ended.code, ended.err) == (0, "")
    assert drawn == [taps.TAPS["tap-hard"]] * 2
    page = (tmp_path / "evidence" / "index.html").read_text(encoding="utf-8")
    assert "failed: no equilibrium" in page
    assert page.count("of the hard fingertip") == 2  # a caption and its alternative text
    assert "of the soft fingertip" not in page


def test_a_triangles_duration() -> None:
    time, force = np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([0.0, 0.0, 100.0, 0.0, 0.0])
    assert taps.duration(time, force) == pytest.approx(2 * 0.99)


def test_the_taps_figures_are_drawn(tmp_path: Path, monkeypatch: Patch) -> None:
    corners = tuple((float(x), y) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    other = tuple((x + 1, y) for x, y in corners)
    own = replace(OWN, cut=(0, 1), corners_mm=(corners, other))
    theirs = replace(next(iter(taps.kept_taps().values())), von_mises_kPa=(1000, 3000))
    monkeypatch.setattr(report, "calculix_tap", lambda *given: theirs)
    monkeypatch.setattr(report, "reference_tap", lambda *given: own)
    report.draw_forces(tmp_path / "taps.png", taps.TAPS.values(), Store(None))
    report.draw_field(tmp_path / "field.png", TAP, Store(None))
    for name in ("taps", "field"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000


@pytest.mark.slow
def test_the_meshed_ball_is_hertzs_to_its_patch() -> None:
    bounce, (depth, _) = by_elements(3e-3, 0.0, 0.3), hertz(3e-3, 0.3)
    largest = 4 / 3 / (1 - 0.3**2) * depth**1.5
    # a/R is 0.13: a ball is stiffer than its half-space by some 0.25 a/R, to the power 2/5
    assert bounce.force.max() == pytest.approx(largest, rel=0.04)


def test_springs_without_friction_have_a_tap_of_their_own() -> None:
    """Whatever element CalculiX took, ours is one; another friction is another tap."""
    answers, asked = asking()
    names = ("tap-soft", "tap-soft-incompatible", "tap-frictionless-incompatible")
    for name in (*names, "tap-soft-penalty", "tap-hard"):
        taps.reference_tap(taps.TAPS[name], answers)
    assert asked[0] == asked[1]
    assert len(set(asked)) == 4


def test_a_measured_balls_losses_are_known_to_their_whole_share() -> None:
    """Half of what the restitution takes of the spin: (1 - e)/2 of it, percent by percent."""
    shallow = [
        row for row in measured_ball.rows(lambda share, text: None, Store(None)) if row.unit == "1"
    ]
    assert shallow
    lost = 50.0 * (1.0 - measured_ball.RESTITUTION)
    for row in shallow:
        assert row.ours is not None
        assert row.ours_error is not None
        assert 100.0 * row.ours_error / row.ours == pytest.approx(lost)


def test_a_slow_balls_largest_numbers_are_hertzs() -> None:
    """Depth (15 m v^2/(16 E* sqrt R))^(2/5), force 4/3 E* sqrt(R) d^1.5, 2.9432 d/v."""
    radius, speed = hertz_ball.RADIUS, hertz_ball.SPEED
    mass = 4 / 3 * math.pi * radius**3 * hertz_ball.DENSITY
    modulus = hertz_ball.YOUNG / (1 - hertz_ball.POISSON**2)
    depth = (15 / 16 * mass * speed**2 / (modulus * radius**0.5)) ** 0.4
    wanted = [1e6 * depth, 4 / 3 * modulus * radius**0.5 * depth**1.5, 1e6 * 2.9432 * depth / speed]
    found = list(hertz_ball.rows("hcm", False, quiet, Store(None)))
    assert [row.unit for row in found] == ["um", "N", "us"]
    assert [row.ours for row in found] == pytest.approx(wanted, rel=1e-3)


def test_a_patchs_limit_is_known_to_its_curve_and_its_mesh(monkeypatch: Patch) -> None:
    """y = 1 + 0.1 h + 5 (a/R)^2: the line's limit is off by its curve, and by 0.1 h at h = 1.5."""

    def solved(speed: float, x: float, poisson: float, coarser: float) -> Bounce:
        patch = math.sqrt(hertz(speed, poisson)[0])
        spun = 1.0 + 0.1 * coarser + 5.0 * patch**2
        return Bounce(*np.zeros((3, 1)), patch=patch, spin=spun)

    monkeypatch.setattr(oblique_ball, "by_elements", solved)
    first, *_ = oblique_ball.limit_rows(quiet, Store(None))
    assert first.ours is not None
    assert first.ours_error == pytest.approx(abs(first.ours - 1.15) + 0.15, rel=1e-6)
    assert abs(first.ours - 1.15) > 1e-3


def test_a_grid_of_second_order_is_extrapolated_to_none(monkeypatch: Patch) -> None:
    """PyElastica's tip at 0.3 m + 8/n^2: 3 times nearer to it than to half as many elements."""
    pytest.importorskip("elastica")
    from validation.peers import pyelastica_pendulum

    places = np.full((len(pendulum.TIMES), 2), 0.3)
    monkeypatch.setattr(pyelastica_pendulum, "swing", lambda *given: places + 8.0 / given[-2] ** 2)
    monkeypatch.setattr(pendulum, "by_hcm", lambda young, count: places)
    for row in pendulum.rows(quiet, Store(None)):
        assert row.outside == pytest.approx(0.3)
        assert row.outside_error == pytest.approx(8.0 / pendulum.THEIRS[-1] ** 2)


def test_an_angle_of_leaving_is_known_to_its_reading_in_degrees(monkeypatch: Patch) -> None:
    """1.2 degrees, and 0.9 of the arrival through d(phi)/d(alpha) where all slips."""
    point = (70.460, 66.903)
    monkeypatch.setattr(measured_ball, "POINTS", (point,))
    (row,) = measured_ball.rows(quiet, Store(None))
    arrives, leaves = (math.radians(degrees) for degrees in point)
    slope = math.cos(leaves) ** 2 / math.cos(arrives) ** 2 / measured_ball.RESTITUTION
    assert row.unit == "deg"
    assert row.outside_error == pytest.approx(math.hypot(1.2, 0.9 * slope), rel=0.1)


@pytest.mark.usefixtures("figures_kept")
def test_the_hierarchys_bars_reach_to_both_sides_of_a_difference(tmp_path: Path) -> None:
    """5 % +- 2.5 % of hcm differs, 1 % +- 2.5 % of the reference agrees."""
    given = ROW, replace(ROW, ours=2.02, model="fem3d")
    report.draw_hierarchy(tmp_path / "h.png", [Shown(piece(lambda *_: []), given)])
    bars = [line for line in plt.gcf().axes[0].lines if len(line.get_xdata()) == 2][:2]
    points = [line for line in plt.gcf().axes[0].lines if len(line.get_xdata()) == 1]
    known = [row.verdict.uncertainty for row in given if row.verdict and row.verdict.uncertainty]
    for bar, e, u, color in zip(bars, (5.0, 1.0), known, (ORANGE, GREEN), strict=True):
        assert bar.get_xdata() == pytest.approx([e - u, e + u])
        assert bar.get_color() == color
    assert [point.get_marker() for point in points] == ["o", "s"]


@pytest.mark.usefixtures("figures_kept")
def test_a_fields_difference_is_red_where_ours_is_more(tmp_path: Path, monkeypatch: Patch) -> None:
    """In the plane of symmetry theirs are 1 and 3 MPa, ours 2 and 3 MPa."""
    corners = tuple((float(x), y) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    other = tuple((x + 1, y) for x, y in corners)
    own = replace(OWN, cut=(0, 1), corners_mm=(corners, other))
    monkeypatch.setattr(report, "calculix_tap", lambda *given: STOPPED)
    monkeypatch.setattr(report, "reference_tap", lambda *given: own)
    report.draw_field(tmp_path / "f.png", TAP, Store(None))
    theirs, ours, apart = (axis.collections[0] for axis in plt.gcf().axes[:3])
    for shown, values in ((theirs, [1.0, 3.0]), (ours, [2.0, 3.0]), (apart, [1.0, 0.0])):
        np.testing.assert_allclose(shown.get_array(), values)
    red, _, blue, _ = apart.to_rgba([1.0])[0]
    assert red > blue


def test_a_curves_rms_is_in_percent_of_its_peak(monkeypatch: Patch) -> None:
    """Of 8, 10 and 4 N ours differ by 1 N once: 1/sqrt(3) of 10 N."""
    monkeypatch.setattr(taps, "calculix_tap", lambda *given: STOPPED)
    monkeypatch.setattr(taps, "reference_tap", lambda *given: OWN)
    peak, *_ = taps.rows(TAP, quiet, Store(None))
    assert "10 and 11 N; RMS of the curve 5.8 %;" in peak.remark
