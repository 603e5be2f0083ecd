"""Restart files: killed runs resume to the same bits; damaged and foreign files are refused."""

import dataclasses
import random
import signal
import subprocess
import zipfile
from pathlib import Path
from typing import Any, get_args

import numba
import numpy as np
import pytest

import meshes
import reference_fem as rf
from reference_fem.dynamics import restart
from reference_fem.dynamics.recorder import Recorder
from reference_fem.dynamics.restart import arithmetic
from reference_fem.settings import Contact
from tests.processes import printed, started
from tests.reference_fem.boxes import boxes

MATERIALS = (rf.Material(1e8, 0.4, 1400.0),) * 2
SURFACE = rf.Surface(0.02, 0.5)
DRIVE = rf.Drive(table=rf.TorqueTable((0.0, 0.2), ((0.0, 0.5e-4), (0.0, 2e-4))))
SETTINGS = rf.Settings(flight="explicit", output_interval=10, snapshots=6, max_samples=40)
MESH = boxes((0.04, 0.03), (0.015, 0.012), (6, 3, 2), half=True)
END = {"distal_face_2": np.flatnonzero(MESH.points[:, 0] == MESH.points[:, 0].min())}

CHILD = """
import sys, time
from pathlib import Path
import tests.reference_fem.test_restart as t
calls = 0
def progress(share, what):
    global calls
    calls += 1
    if calls == int(sys.argv[2]):
        print("ready", flush=True)
        time.sleep(60)
t.tap(t.rf.Restart(Path(sys.argv[1]), every_s=0.0), progress)
"""


def tap(restart: rf.Restart | None = None, progress: Any = None, **changes: Any) -> rf.TapResult:
    given = {"mesh": MESH, "materials": MATERIALS, "surface": SURFACE, "drive": DRIVE}
    given |= {"settings": SETTINGS} | changes
    return rf.simulate(**given, progress=progress, restart=restart)


class Counter:
    """Counts a run's reports, and interrupts it at one of them."""

    def __init__(self, last: int = 0) -> None:
        self.reports, self.last = 0, last

    def __call__(self, share: float, what: str) -> None:
        self.reports += 1
        if self.reports == self.last:
            raise KeyboardInterrupt


@pytest.fixture(scope="module")
def undisturbed() -> tuple[rf.TapResult, int]:
    """A run without restart files, and how often it reported."""
    numba.set_num_threads(1)
    counter = Counter()
    return tap(None, counter), counter.reports


def killed(path: Path, calls: int, **changes: str) -> None:
    """A run killed while it reports for the `calls`-th time, in a changed environment."""
    with started("-c", CHILD, path, calls, env=changes, stdout=subprocess.PIPE) as child:
        assert child.stdout.readline() == "ready\n"
        child.kill()
    assert child.returncode == -signal.SIGKILL


def assert_same_bits(one: Any, two: Any, name: str = "result") -> None:
    """Equal to the last bit, all but the wall time."""
    if dataclasses.is_dataclass(one):
        for field in dataclasses.fields(one):
            if field.name != "wall_time_s":
                pair = getattr(one, field.name), getattr(two, field.name)
                assert_same_bits(*pair, f"{name}.{field.name}")
    elif isinstance(one, tuple):
        assert len(one) == len(two), name
        for i, pair in enumerate(zip(one, two, strict=True)):
            assert_same_bits(*pair, f"{name}[{i}]")
    elif isinstance(one, np.ndarray):
        assert one.tobytes() == two.tobytes(), name
    else:
        assert one == two, name


# Of some 400 reports the last dozen come from the contact.
@pytest.mark.parametrize("calls", [2, 150, 395])
def test_killed_run_resumes_to_the_same_bits(
    calls: int, undisturbed: tuple[rf.TapResult, int], tmp_path: Path
) -> None:
    path = tmp_path / "restart.npz"
    killed(path, calls)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    counter = Counter()
    resumed = tap(rf.Restart(path, resume=True), counter)
    whole, reports = undisturbed
    assert resumed.status is rf.Status.COMPLETED
    assert_same_bits(resumed, whole)
    # It went on: one report of the set-up, then those that the killed run did not make.
    assert counter.reports == 1 + reports - calls
    # Killed again before the result was kept: the file is still there, and as good as before.
    assert_same_bits(tap(rf.Restart(path, resume=True)), whole)


def test_an_interrupt_saves_where_it_came(
    undisturbed: tuple[rf.TapResult, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It left the file of the first block, and up to half a minute was solved again."""
    path, (whole, reports) = tmp_path / "restart.npz", undisturbed
    assert tap(rf.Restart(path), Counter(reports - 20)).status is rf.Status.INTERRUPTED
    saved, add, counter = path.read_bytes(), Recorder.add, Counter()
    assert_same_bits(tap(rf.Restart(path, resume=True), counter), whole)
    assert counter.reports == 1 + 20

    def interrupted(*given: Any) -> None:
        add(*given)
        raise KeyboardInterrupt

    path.write_bytes(saved)
    with monkeypatch.context() as patch:  # a block recorded, but not gone on from
        patch.setattr(Recorder, "add", interrupted)
        assert tap(rf.Restart(path, resume=True)).status is rf.Status.INTERRUPTED
    assert_same_bits(tap(rf.Restart(path, resume=True)), whole)


def test_a_rigid_flights_errors_are_those_of_a_run_that_went_through(tmp_path: Path) -> None:
    """What the steps between flight and touch change is in them, also where another run made them.

    The tip is fine where it touches: else a facet's sagitta hides that.
    """
    finger = meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3)
    sizing = meshes.Sizing(5e-3, 1e-2, 5e-4, contact_angle=0.9)
    given = {
        "mesh": meshes.finger_quadrilaterals(finger, sizing),
        "companion": meshes.finger_quadrilaterals(finger, sizing.coarser(2.0)),
        "materials": (rf.Material(2e7, 0.4, 1400.0),) * 3,
        "surface": rf.Surface(0.1, 0.5),
        "drive": rf.Drive(),
        "settings": rf.Settings(),
    }
    path = tmp_path / "restart.npz"
    counter = Counter()
    whole = tap(None, counter, **given)
    assert whole.errors
    middle = Counter(counter.reports // 2)
    assert tap(rf.Restart(path, every_s=0.0), middle, **given).status is rf.Status.INTERRUPTED
    resumed = tap(rf.Restart(path, resume=True), **given)
    assert resumed.errors == whole.errors
    assert resumed.cautions == whole.cautions


def test_restart_files_change_nothing(
    undisturbed: tuple[rf.TapResult, int], tmp_path: Path
) -> None:
    path = tmp_path / "restart.npz"
    assert_same_bits(tap(rf.Restart(path, every_s=0.05)), undisturbed[0])
    assert list(tmp_path.iterdir()) == [path]
    path.unlink()  # Nothing to resume: the run starts from the beginning.
    assert_same_bits(tap(rf.Restart(path, resume=True)), undisturbed[0])


@pytest.mark.parametrize("contact", [*get_args(Contact), rf.LumpedContact(1e5, restitution=0.9)])
def test_every_contact_law_resumes_in_the_midst_of_contact(contact: Any, tmp_path: Path) -> None:
    path = tmp_path / "restart.npz"
    changes = {"flight": "rigid", "lead_steps": 5, "output_interval": 4, "contact": contact}
    settings = dataclasses.replace(SETTINGS, **changes)
    given: dict[str, Any] = {"settings": settings}
    if not isinstance(contact, str):  # the middle of the end comes down, the first phalanx must not
        given["mesh"] = dataclasses.replace(MESH, node_sets={**MESH.node_sets, **END})
        given["surface"] = rf.Surface(0.05, 0.5)
    if contact == "impulse":
        given["materials"] = (dataclasses.replace(MATERIALS[0], relaxation_time=1e-5),) * 2
    counter = Counter()
    whole = tap(None, counter, **given)
    assert whole.status is rf.Status.COMPLETED
    assert counter.reports > 15
    # Stopped at the middle of the contact, and again after resuming.
    for last in (counter.reports // 2, counter.reports // 4):
        stopped = tap(rf.Restart(path, resume=True, every_s=0.0), Counter(last), **given)
        assert stopped.status is rf.Status.INTERRUPTED
        assert stopped.history.normal_force_N.max() > 0
        assert path.exists()
    assert_same_bits(tap(rf.Restart(path, resume=True), **given), whole)


@pytest.fixture
def left(tmp_path: Path) -> Path:
    """The restart file of a run that was stopped in flight."""

    def stop(share: float, what: str) -> None:
        if share > 0.0:
            raise KeyboardInterrupt

    path = tmp_path / "restart.npz"
    assert tap(rf.Restart(path, every_s=0.0), stop).status is rf.Status.INTERRUPTED
    return path


def refusal(path: Path, **changes: Any) -> str:
    before = path.read_bytes()
    with pytest.raises(rf.RestartError) as caught:
        tap(rf.Restart(path, resume=True), **changes)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{path}: the restart file ")
    assert message.endswith("delete it or start without resuming")
    assert path.read_bytes() == before
    return message


@pytest.mark.parametrize("kept", [0.0, 0.1, 0.5, 0.99])
def test_truncated_file(left: Path, kept: float) -> None:
    content = left.read_bytes()
    left.write_bytes(content[: int(kept * len(content))])
    assert "is truncated or not a restart file" in refusal(left)


def saved(path: Path, **arrays: Any) -> None:
    with path.open("wb") as file:
        np.savez(file, **arrays)


def test_every_kind_of_foreign_file(left: Path) -> None:
    left.write_text("not numpy\n")
    assert "is truncated or not a restart file" in refusal(left)
    unpickled = {"identity": np.array([{}], dtype=object), "checksum": np.zeros(1)}
    for arrays in ({"a": np.zeros(3)}, unpickled):
        saved(left, **arrays)
        assert "is truncated or not a restart file" in refusal(left)


def test_flipped_bit(left: Path) -> None:
    with zipfile.ZipFile(left) as archive:  # in the data, not in a header
        largest = max(archive.infolist(), key=lambda member: member.compress_size)
    content = bytearray(left.read_bytes())
    content[largest.header_offset + largest.compress_size // 2] ^= 1
    left.write_bytes(content)
    assert "is truncated or not a restart file (Bad CRC-32" in refusal(left)


def test_altered_number_with_a_whole_archive(left: Path) -> None:
    with np.load(left) as file:
        content = dict(file)
    content["state.displacement"][0, 0] += 1e-9
    saved(left, **content)
    assert "was altered after it was written" in refusal(left)


FORGED = (
    None, np.array(1.0), np.zeros(3), np.zeros((2, 2)), np.array("x"), np.array(["a", "b"]),
    np.full(2, np.nan), np.array([0, -1]), np.zeros((1, 1, 1, 1)), np.array(1j), np.array(True),
)  # fmt: skip


def test_forged_arrays_with_a_right_checksum(left: Path) -> None:
    """Every array in turn, in the place of which another one or none stands."""
    with np.load(left) as file:
        content = dict(file)
    names = sorted(set(content) - {restart.IDENTITY, restart.CHECKSUM})
    dice = random.Random(13)
    for name in names:
        value = dice.choice([v for v in FORGED if v is None or not alike(v, content[name])])
        forged = {key: content[key] for key in names} | {name: value}
        forged = {key: array for key, array in forged.items() if array is not None}
        checksum = np.array(restart.digest(forged))
        saved(left, identity=content[restart.IDENTITY], checksum=checksum, **forged)
        message = refusal(left)
        assert "does not fit this run: " in message, (name, value)
        assert name.split(".")[0] in message, (name, value)


def alike(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether one could stand for the other."""
    return one.shape == other.shape and one.dtype.kind == other.dtype.kind


def test_another_runs_file_is_refused_by_name(left: Path) -> None:
    finer = boxes((0.04, 0.03), (0.015, 0.012), (7, 3, 2), half=True)
    stiffer = (MATERIALS[0], rf.Material(2e8, 0.4, 1400.0))
    settings = dataclasses.replace(SETTINGS, penalty_factor=0.2)
    for name, change in (
        ("mesh", {"mesh": finer}),
        ("materials", {"materials": stiffer}),
        ("surface", {"surface": rf.Surface(0.021, 0.5)}),
        ("drive", {"drive": rf.Drive(torques=(0.0, 2e-4))}),
        ("settings", {"settings": settings}),
    ):
        assert f"belongs to another run: different {name};" in refusal(left, **change)
    # An explicit number of threads that is the same number is the same run.
    one = dataclasses.replace(SETTINGS, threads=1)
    assert tap(rf.Restart(left, resume=True), settings=one).status is rf.Status.COMPLETED


@pytest.mark.parametrize("library", ["numba", "scikit-fem"])
def test_another_programs_file_is_refused(
    left: Path, monkeypatch: pytest.MonkeyPatch, library: str
) -> None:
    """Kernels compiled by another numba; elements and facets from another scikit-fem."""
    given = restart.versions
    monkeypatch.setattr(restart, "versions", lambda *names: given(*names) | {library: "0.0"})
    assert "different program" in refusal(left)


def test_another_meshers_file_is_refused(left: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The facets that may touch, and the hinges' faces, are found by functions of `meshes`."""
    monkeypatch.setattr(meshes, "__file__", str(left))
    assert "different program" in refusal(left)


def test_a_file_from_other_kernels_of_blas_is_refused(tmp_path: Path) -> None:
    # OpenBLAS takes the kernels of a processor that it is told of; the oldest of all run anywhere.
    other = {"OPENBLAS_CORETYPE": "Prescott"}
    show = "from reference_fem.dynamics.restart import arithmetic; print(arithmetic())"
    if printed("-c", show, env=other).strip() == arithmetic():
        pytest.skip("this BLAS has one set of kernels")
    path = tmp_path / "restart.npz"
    killed(path, 2, **other)
    assert "belongs to another run: different processor or BLAS;" in refusal(path)


def test_folder_that_cannot_be_written(tmp_path: Path) -> None:
    path = tmp_path / "nowhere" / "restart.npz"
    with pytest.raises(rf.RestartError, match="cannot be written"):
        tap(rf.Restart(path, every_s=0.0))
