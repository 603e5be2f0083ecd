"""The one call: a finger falls and taps a surface."""

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

import numba

import meshes
from reference_fem.arrays import Progress
from reference_fem.dynamics.archive_check import check_archive
from reference_fem.dynamics.coarse_flight import CoarseFlight, coarse_flight
from reference_fem.dynamics.loop import Reporting, explicit_tap, result_of
from reference_fem.dynamics.recorder import Recorder
from reference_fem.dynamics.restart import Restart, RestartFile, identity
from reference_fem.dynamics.state import LoopState, unpack
from reference_fem.dynamics.step import CutsSurfaceError, start_state
from reference_fem.estimates.estimate import SolvedScene, estimated
from reference_fem.flight.rigid_flight import Descent, descent, inner_gap, surface_gap
from reference_fem.model import Model, build_model
from reference_fem.results.result import Status, TapResult
from reference_fem.rigid.rigid_chain import ChainState, chain_and_start, pose
from reference_fem.scene import Scene, check_optional
from reference_fem.settings import NEO_HOOKE, ONE_POINT, Drive, Material, Settings, Surface
from reference_fem.workload import TooLongError, check_work

# A force evaluation of this many cells takes about a millisecond on one thread.
THREADED_CELLS = 8000


def simulate(
    mesh: meshes.FingerMesh,
    materials: Sequence[Material],
    surface: Surface,
    drive: Drive,
    settings: Settings | None = None,
    progress: Progress | None = None,
    start: ChainState | None = None,
    restart: Restart | None = None,
    companion: meshes.FingerMesh | None = None,
    compared: TapResult | None = None,
    flight_mesh: meshes.FingerMesh | None = None,
) -> TapResult:
    """Let the finger of `mesh` fall and tap the surface.

    Parameters
    ----------
    mesh : 3D (the half Z >= 0 with a node set `symmetry`, or the full body) or 2D (plane stress)
    materials : one per phalanx
    surface, drive, settings : see `settings`
    progress : called with the share done, of the run and then of its companion, and what is going
        on
    start : rigid state to start the flight from: absolute angles, rates and time; None: at rest
        along -X at t = 0. An impact state starts right above the surface.
    restart : file from which the explicit run can be resumed after a kill, and whether to resume;
        None: no file.
    companion : a mesh of other edge lengths, with which `Settings.estimate` compares the run; None:
        errors are estimated from the edges of `mesh` alone.
    compared : a completed run of the same finger on `companion`, if there is one already
    flight_mesh : a mesh of the same finger with longer edges, for `Settings.flight` = "coarse"

    Returns
    -------
    TapResult
        For the full body; a failure of the run is reported in its status, not raised.

    Raises
    ------
    ValueError
        For bad input, naming it, its value and what is allowed; a restart file that is damaged
        or another run's is a `RestartError`.
    """
    settings = Settings() if settings is None else settings
    scene = Scene(mesh, materials, surface, drive, settings, start, flight_mesh)
    if progress is not None and not callable(progress):
        raise ValueError(f"progress = {progress!r}: must be a function of (fraction, text)")
    check_optional("restart", restart, Restart)
    _check_comparison(scene, companion, compared)
    run, solved = _solve(scene, progress, restart)
    run = replace(run, given=scene.given)
    if not settings.estimate or run.status is not Status.COMPLETED:
        return run
    once = replace(settings, estimate=False, flight="rigid", end_time_s=None, snapshots=2)

    # the companion of a run with few elements is finer, and may take longer than the run
    estimating = None if progress is None else partial(_estimating, progress)

    def again(other: meshes.FingerMesh, state: ChainState) -> TapResult | None:
        if compared is not None:
            return compared
        tap = replace(scene, mesh=other, settings=once, start=state, flight_mesh=None)
        try:
            return _solve(tap, estimating)[0]
        except (CutsSurfaceError, TooLongError):  # nodes may lie lower, edges ask for more
            return None

    try:
        return estimated(run, solved, companion, again)
    except KeyboardInterrupt:
        message = (
            "interrupted while errors were estimated, which a resumed run begins again:"
            f" {Status.INTERRUPTED.advice}"
        )
        return replace(run, status=Status.INTERRUPTED, message=message)


def _estimating(progress: Progress, share: float, what: str) -> None:
    """Report what a companion's run does."""
    progress(share, f"estimate of errors, {what}")


def _check_comparison(
    scene: Scene, companion: meshes.FingerMesh | None, compared: TapResult | None
) -> None:
    """Raise ValueError if a run of the scene can't be compared with these."""
    check_optional("companion", companion, meshes.FingerMesh)
    check_optional("compared", compared, TapResult)
    for part in ("materials", "surface", "drive"):
        if compared is not None and compared.given[part] != scene.given[part]:
            raise ValueError(f"compared: its {part} is not this run's: must be of the same finger")
    mesh = scene.mesh
    if companion is None:
        return
    if not isinstance(scene.settings.contact, str):
        raise ValueError(
            "companion: a lumped contact has no patch by which a mesh is judged: leave it out,"
            " and compare with a run on another mesh"
        )
    if (companion.dim, companion.phalanges) != (mesh.dim, mesh.phalanges):
        raise ValueError(
            f"companion: {companion.dim}D with {companion.phalanges} phalanges: must be a mesh"
            f" of the run's finger, {mesh.dim}D with {mesh.phalanges}"
        )
    if None not in (companion.shape, mesh.shape) and companion.shape != mesh.shape:
        raise ValueError("companion: its shape is not that of the run's mesh, another finger's")


def _solve(
    scene: Scene, progress: Progress | None = None, restart: Restart | None = None
) -> tuple[TapResult, SolvedScene]:
    """Run from the start, or from where a restart file left off."""
    settings, light_mesh = scene.settings, scene.flight_mesh
    with _threads(settings.threads, len(scene.mesh.cells)):
        started = time.perf_counter()
        if progress is not None:
            progress(0.0, "set-up")
        file = None
        if restart is not None:
            # The bits may depend on the number of threads: it belongs to the identity.
            counted = replace(settings, threads=numba.get_num_threads(), estimate=False)
            file = RestartFile(restart, identity(**vars(replace(scene, settings=counted))))
        archive = None if file is None else file.read()
        parts = scene.materials, scene.surface, scene.drive
        model = build_model(scene.mesh, *parts, settings)
        coarse = None
        if light_mesh is not None:
            others = replace(
                settings, contact="impulse", element=_flying_element(scene, light_mesh)
            )
            coarse = coarse_flight(build_model(light_mesh, *parts, others), model)
        reporting = Reporting(progress, file, started)
        if archive is not None and file is not None:
            try:
                check_archive(model, archive, coarse)
            except ValueError as error:
                raise file.refused(f"does not fit this run: {error}") from error
            recorder = Recorder(settings)
            recorder.restore(archive)
            result = explicit_tap(model, settings, unpack(archive), reporting, recorder, coarse)
            return result, SolvedScene(scene, model, None)
        result, flown = _run_from_start(model, settings, scene.start, coarse, reporting)
        return result, SolvedScene(scene, model, flown)


def _flying_element(scene: Scene, light_mesh: meshes.FingerMesh) -> str | None:
    """The element of a coarse flight: the run's own in 2D or where its law is neo-Hookean, else the
    one-point element, which has no damping, unless it is damped.
    """
    if light_mesh.dim == 2 or scene.materials[0].law == NEO_HOOKE:
        return scene.settings.element
    damped = light_mesh.relaxing.size and any(m.relaxation_time for m in scene.materials)
    return None if damped else ONE_POINT


def _run_from_start(
    model: Model,
    settings: Settings,
    start: ChainState | None,
    coarse: CoarseFlight | None,
    reporting: Reporting,
) -> tuple[TapResult, Descent | None]:
    """From the start to the tap: a rigid flight, which is returned too, or explicit steps all the
    way.
    """
    chain, rigid = chain_and_start(model.chain, start)
    gap, inner, height = surface_gap(model, chain), inner_gap(model, chain), model.surface.height
    clearance = min(gap(rigid.angles), inner(rigid.angles))
    if clearance <= 0.0:
        raise CutsSurfaceError(
            f"height = {height}: the surface cuts {-clearance:.3g} m into the finger "
            "at the start; it must lie below it"
        )
    origin = chain.energy(rigid) * model.symmetry_factor
    flown, torque_change_work = None, 0.0
    if settings.flight == "rigid":
        if reporting.progress is not None:
            reporting.progress(0.0, "rigid flight")
        left = math.inf if settings.end_time_s is None else settings.end_time_s - rigid.time_s
        longest = min(settings.max_flight_time_s, left)
        status = Status.NOT_REACHED
        message = f"height = {height}: the surface is not reached within {longest:.6g} s"
        try:
            flown = descent(chain, gap, rigid, settings)
            if flown and (at := flown.closing_of(chain, inner)) is not None:
                flown, status = None, Status.PASSED_THROUGH
                message = (
                    f"a phalanx before the last, which alone can touch, meets the surface at t ="
                    f" {at:.6g} s"
                )
        except KeyboardInterrupt:
            status, message = Status.INTERRUPTED, "interrupted in the rigid flight"
        if flown is None:
            still = pose(chain, rigid, model.points, model.body_of_point)
            now = LoopState(start_state(model, *still, rigid.time_s), rigid.time_s)
            nothing = Recorder(settings)
            result = result_of(model, settings, now, reporting, nothing, status, message)
            return result, None
        begin, rigid = rigid.time_s, flown.before(settings.lead_steps * model.step_s)
        torque_change_work = chain.torques.torque_change_work(
            lambda time: flown.state_at(time).angles, begin, rigid.time_s
        )
    first = model if coarse is None else coarse.model
    check_work(first, settings, rigid.time_s)
    motion = pose(chain, rigid, first.points, first.body_of_point)
    state = start_state(first, *motion, rigid.time_s, rigid.angles, torque_change_work)
    begin_state = LoopState(state, rigid.time_s, origin_energy_J=origin, coarse=coarse is not None)
    return explicit_tap(model, settings, begin_state, reporting, flight=coarse), flown


@contextmanager
def _threads(wanted: int | None, cells: int) -> Iterator[None]:
    """Set numba's number of threads for the duration of a run."""
    most = numba.config.NUMBA_NUM_THREADS
    if wanted is not None and wanted > most:
        raise ValueError(f"threads = {wanted}: this machine offers {most}; use at most that")
    before = numba.get_num_threads()
    numba.set_num_threads(wanted or (most if cells >= THREADED_CELLS else 1))
    try:
        yield
    finally:
        numba.set_num_threads(before)
