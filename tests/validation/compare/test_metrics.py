import numpy as np
import pytest

from tests.validation.commands import Make
from validation.compare.claims import find
from validation.compare.differences import error_percent, spread
from validation.compare.force_curves import contact_curve
from validation.compare.sprague_geers import compare_forces, sprague_geers
from validation.harness.quantities import COMPARED, quantity

TIME = np.linspace(0, 1, 2001)
SINE = np.sin(2 * np.pi * TIME)


@pytest.mark.parametrize("scale", [1.0, 1.1, 0.8, 3.0])
def test_a_scaled_curve_differs_in_magnitude_alone(scale: float) -> None:
    result = sprague_geers(TIME, scale * SINE, SINE)
    # arccos loses half the digits where its argument is 1: sqrt(2 * 2.2e-16)/pi = 7e-9
    lost = 1e-7
    assert result.magnitude == pytest.approx(scale - 1, rel=1e-12)
    assert result.phase == pytest.approx(0, abs=lost)
    known = {"abs": lost} if scale == 1 else {"rel": 1e-9}
    assert result.combined == pytest.approx(abs(scale - 1), **known)


@pytest.mark.parametrize("shift", [0.01, 0.1, 0.25])
def test_a_shifted_sine_differs_in_phase_alone(shift: float) -> None:
    # over whole periods <sin(wt) sin(w(t + s))> / <sin^2> = cos(2 pi s), so P = 2 s
    result = sprague_geers(TIME, np.sin(2 * np.pi * (TIME + shift)), SINE)
    assert result.phase == pytest.approx(2 * shift, rel=1e-6)
    assert result.magnitude == pytest.approx(0, abs=1e-9)


def test_a_negative_curve_is_in_opposite_phase() -> None:
    assert sprague_geers(TIME, -SINE, SINE).phase == pytest.approx(1)


def test_hand_computed_curves() -> None:
    # constant 1 against the ramp t: psi = 1, 1/3, 1/2; M = 1/sqrt(1/3) - 1, P = acos(sqrt(3)/2)/pi
    result = sprague_geers(TIME, np.ones_like(TIME), TIME)
    assert result.magnitude == pytest.approx(np.sqrt(3) - 1, rel=1e-6)
    assert result.phase == pytest.approx(1 / 6, rel=1e-6)
    assert result.combined == pytest.approx(np.hypot(np.sqrt(3) - 1, 1 / 6), rel=1e-6)


@pytest.mark.parametrize("scale", [1e-300, 1e200])
def test_the_size_of_units_is_none_of_it(scale: float) -> None:
    result = sprague_geers(scale * TIME, 1.1 * scale * SINE, scale * SINE)
    assert (result.magnitude, result.phase) == pytest.approx((0.1, 0.0), abs=1e-7)


def test_a_zero_curve_is_refused() -> None:
    with pytest.raises(ValueError, match="zero"):
        sprague_geers(TIME, 0 * SINE, SINE)


def test_forces_are_aligned_at_first_contact(make_record: Make) -> None:
    first = make_record()
    delay = 0.01
    later = make_record(
        summary={**first.summary, "contact_time_s": first.summary["contact_time_s"] + delay},
        history={**first.history, "time_s": first.history["time_s"] + delay},
    )
    result = compare_forces(later, first)
    assert result.combined == pytest.approx(0, abs=1e-6)


def test_forces_without_contact_or_friction_are_not_compared(make_record: Make) -> None:
    run = make_record()
    smooth = make_record(history={**run.history, "tangential_force_N": 0 * run.history["time_s"]})
    assert compare_forces(smooth, run, "tangential_force_N") is None
    flying = make_record(summary={**run.summary, "contact_duration_s": None})
    assert compare_forces(flying, run) is None


@pytest.mark.parametrize(
    ("value", "truth", "percent"),
    [(110, 100, 10), (-90, -100, -10), (None, 100, None), (1, 0, None), (103, 4e-13, None)],
)
def test_error_percent(value: float | None, truth: float, percent: float | None) -> None:
    assert error_percent(value, truth) == pytest.approx(percent)


def test_papers_own_errors_follow_from_its_values() -> None:
    hcm, reference, printed = (
        find("Table 2", "hard", f"{prefix} peak normal force")
        for prefix in ("HCM", "reference", "error of")
    )
    assert abs(error_percent(hcm.number, reference.number) or 0) == pytest.approx(
        printed.number, abs=5e-4
    )


def test_spread(make_record: Make) -> None:
    runs = [make_record(peak=peak) for peak in (60.0, 66.0, 63.0)]
    peak = quantity("peak_normal_force_N")
    band = spread(runs, peak)
    assert band == (60, 66, 3)
    assert spread(runs[:1], peak) is None
    assert spread([runs[0], make_record(ok=False)], peak) is None


def test_quantities_read_what_they_say(make_record: Make) -> None:
    run = make_record(peak=100.0, duration=3e-4)
    assert quantity("contact_duration_s").read(run) == pytest.approx(300)
    assert quantity("normal_impulse_N_s").read(run) == pytest.approx(2 * 100 * 0.3 / np.pi)
    assert quantity("tip_velocity_y_m_per_s").read(run) == -1.65
    empty = make_record(summary={})
    assert all(entry.read(empty) is None for entry in COMPARED)


def test_steps_weigh_by_their_length() -> None:
    """The constant and the ramp of `test_hand_computed_curves` on steps that grow."""
    time = TIME**2
    result = sprague_geers(time, np.ones_like(time), time)
    assert result.magnitude == pytest.approx(np.sqrt(3) - 1, rel=1e-5)
    assert result.phase == pytest.approx(1 / 6, rel=1e-5)


def test_the_window_reaches_to_the_later_separation(make_record: Make) -> None:
    """sin(pi x) up to x = 1 against sin(pi x/2) up to 2: psi are 1/2, 1 and 4/(3 pi)."""
    brief, long = make_record(), make_record(duration=4e-4)
    phase = np.arccos(4 / (3 * np.pi) / np.sqrt(0.5)) / np.pi
    for computed, reference, ratio in ((brief, long, 0.5), (long, brief, 2.0)):
        found = compare_forces(computed, reference)
        assert found is not None
        assert found.magnitude == pytest.approx(np.sqrt(ratio) - 1, abs=1e-5)
        assert found.phase == pytest.approx(phase, abs=1e-5)


def test_a_force_is_zero_beyond_its_own_steps(make_record: Make) -> None:
    """A record may end in contact, at its last step with force."""
    whole = make_record()
    cut = make_record(history={name: of[400:1200] for name, of in whole.history.items()})
    time = cut.history["time_s"][[0, -1]] - whole.summary["contact_time_s"]
    at = [time[0] - 1e-6, time[0], time[1], time[1] + 1e-6]
    first, last = cut.history["normal_force_N"][[0, -1]]
    assert min(first, last) > 1.0
    found = contact_curve(cut, "normal_force_N", np.array(at))
    assert found == pytest.approx([0.0, first, last, 0.0], rel=1e-9)
