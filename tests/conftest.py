import signal
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hcm.compiled import ByKind
from tests.validation.commands import Capture, Ended, Patch, Run, Use, call, fake_adapter
from validation.harness.provenance import provenance
from validation.harness.record import Event, RunRecord
from validation.models.adapter import Outcome
from validation.runs import execute
from validation.scenes.load import load_scene

PEAK, DURATION, CONTACT, FRICTION = 64.0, 2e-4, 0.136, 0.5


@pytest.fixture(scope="session", autouse=True)
def interrupts_are_heard() -> Iterator[None]:
    """What a shell or `nohup` starts may be deaf to signals, and so are its children."""
    before = {
        signal.SIGINT: signal.signal(signal.SIGINT, signal.default_int_handler),
        signal.SIGHUP: signal.signal(signal.SIGHUP, signal.SIG_DFL),
    }
    yield
    for number, answer in before.items():
        signal.signal(number, answer)


@pytest.fixture(scope="session", autouse=True)
def kinds_are_looked_at() -> Iterator[None]:
    """Calls that numba does not look at have the types that their kernel was compiled for."""
    call = ByKind.__call__

    def looked_at(kernel: ByKind, kind: Any, *args: Any) -> Any:
        entry = kernel.entries.get(kind)
        assert entry is None or kernel.looked_at(args) is entry
        return call(kernel, kind, *args)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ByKind, "__call__", looked_at)
        yield


@pytest.fixture
def fingertap(capsys: Capture) -> Run:
    """Runs a command in the test's own process."""

    def run(*arguments: object) -> Ended:
        code = call(*arguments)
        return Ended(code, *capsys.readouterr())

    return run


@pytest.fixture
def make_record() -> Callable[..., RunRecord]:
    """A run whose contact force is a half sine: peak, duration and impulse 2 F T / pi are known."""

    def make(
        scene: str = "soft",
        model: str = "hcm",
        variant: str = "",
        peak: float = PEAK,
        duration: float = DURATION,
        **changes: Any,
    ) -> RunRecord:
        time = CONTACT + np.linspace(-0.1 * duration, 1.1 * duration, 2401)
        phase = np.clip((time - CONTACT) / duration, 0, 1)
        normal = peak * np.sin(np.pi * phase)
        summary = {
            "contact_time_s": CONTACT,
            "tip_velocity_at_contact_m_per_s": (1.8, -1.65),
            "peak_normal_force_N": peak,
            "peak_normal_force_time_s": duration / 2,
            "first_peak_normal_force_N": peak,
            "peak_tangential_force_N": -FRICTION * peak,
            "contact_duration_s": duration,
            "normal_impulse_N_s": 2 * peak * duration / np.pi,
            "compression_to_restitution": 1,
            "stick_to_slip": 0,
            "slip_to_stick": 0,
            "reverse_slip": False,
            "peak_stress_R_Pa": 2.24e6,
            "energy_residual": 1e-6,
            "wall_time_s": 0.25 if model == "hcm" else 50.0,
            "peak_memory_MB": 180.0,
            "steps": 3000,
            "elements": None if model == "hcm" else 4000,
            "time_step_s": None if model == "hcm" else 5e-7,
        }
        fields: dict[str, Any] = {
            "status": "COMPLETED",
            "ok": True,
            "message": "",
            "summary": summary,
            "history": {
                "time_s": time,
                "normal_force_N": normal,
                "tangential_force_N": -FRICTION * normal,
                "tip_position_m": np.column_stack([time, -time]),
            },
            "events": (Event(CONTACT, "contact"), Event(CONTACT + duration, "separation")),
            "provenance": provenance(load_scene(scene).document),
        } | changes
        return RunRecord(scene, model, variant, **fields)

    return make


@pytest.fixture
def fake_model(monkeypatch: Patch, make_record: Callable[..., RunRecord]) -> Use:
    """Every model becomes one that returns the given record or raises the given error."""

    def use(record: RunRecord | None = None, error: BaseException | None = None) -> None:
        def run(scene: Any, progress: Any = None, checkpoint: Any = None) -> Outcome:
            if error is not None:
                raise error
            return Outcome(replace(record or make_record(), scene=scene.name))

        monkeypatch.setattr(execute, "adapter", lambda name: fake_adapter(run))

    return use
