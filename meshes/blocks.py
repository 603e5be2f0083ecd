"""Transfinite blocks on gmsh's built-in kernel: points, curves, four-sided faces, hexahedra.

`gmsh_session` lends a gmsh model and restores everything afterwards, whatever happens in between.

Faces are found by their four corners and curves by their two ends, so that blocks that name the
same points share them. Lengths are in millimetres here: gmsh's tolerances are absolute.
"""

import ctypes
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType

import numpy as np

from meshes.errors import MeshError
from meshes.grading import Division
from meshes.mesh import Floats, Ints

_OPTIONS = {
    "General.Terminal": 0,
    "General.Verbosity": 0,
    "General.NumThreads": 1,  # several threads may number nodes differently from run to run
    "Geometry.AutoCoherence": 0,
    "Mesh.ElementOrder": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.Renumber": 0,
}

# gmsh keeps its state per process, so two threads must not build at the same time.
_LOCK = threading.Lock()


@contextmanager
def _answers_to_signals_kept() -> Iterator[None]:
    """Restore this process's signal handlers afterwards, in any thread.

    When it is initialized, gmsh resets SIGINT, SIGTERM, SIGHUP and SIGPIPE to the system's defaults
    (seen with 4.15), whatever it is told: Python's handlers would never be called again.
    """
    system = ctypes.CDLL(None)
    answers = {number: ctypes.create_string_buffer(256) for number in signal.valid_signals()}
    known = {n: answer for n, answer in answers.items() if system.sigaction(n, None, answer) == 0}
    try:
        yield
    finally:
        for number, answer in known.items():
            system.sigaction(number, answer, None)


@contextmanager
def gmsh_session(name: str) -> Iterator[ModuleType]:
    """Yield the gmsh module with an empty model of that name, and clean up afterwards.

    gmsh is initialized without signal handling (so that it works outside the main thread too) and
    finalized at the end; if the caller had it running already, only our model is removed and the
    caller's options and current model are put back.

    Raises MeshError: gmsh cannot be loaded or reports an error of its own.
    """
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise MeshError(
            f"gmsh cannot be loaded ({error}): on Debian or Ubuntu install libgl1 libglu1-mesa "
            "libxft2 libxcursor1 libxinerama1 libgomp1"
        ) from error
    with _LOCK:
        ours = not gmsh.isInitialized()
        if ours:
            with _answers_to_signals_kept():
                gmsh.initialize(readConfigFiles=False, interruptible=False)
        before = {key: gmsh.option.getNumber(key) for key in _OPTIONS}
        current = gmsh.model.getCurrent()
        try:
            for key, value in _OPTIONS.items():
                gmsh.option.setNumber(key, value)
            gmsh.model.add(name)
            yield gmsh
        finally:
            if ours:
                gmsh.finalize()
            else:
                gmsh.model.remove()
                for key, value in before.items():
                    gmsh.option.setNumber(key, value)
                if current in gmsh.model.list():
                    gmsh.model.setCurrent(current)


class Blocks:
    """A block structure under construction in gmsh's current model."""

    def __init__(self, gmsh: ModuleType) -> None:
        self._gmsh = gmsh
        self._curves: dict[tuple[int, int], int] = {}
        self._divisions: dict[int, Division] = {}
        self._faces: dict[frozenset[int], int] = {}
        self._index: Ints = np.empty(0, dtype=np.int64)

    def point(self, x: float, y: float, z: float = 0.0) -> int:
        """Add a point (mm)."""
        return int(self._gmsh.model.geo.addPoint(x, y, z))

    def curve(self, p: int, q: int, division: Division, centre: int | None = None) -> None:
        """Join p to q by a straight line, or by the circular arc about the point `centre`."""
        geo = self._gmsh.model.geo
        tag = geo.addLine(p, q) if centre is None else geo.addCircleArc(p, centre, q)
        self._divide(p, q, tag, division)

    def spline(self, p: int, q: int, count: int, via: Sequence[tuple[float, float, float]]) -> None:
        """Join p to q by `count` edges along the spline through the positions `via` (mm)."""
        geo = self._gmsh.model.geo
        tag = geo.addSpline([p, *(self.point(*position) for position in via), q])
        self._divide(p, q, tag, Division(count))

    def _divide(self, p: int, q: int, tag: int, division: Division) -> None:
        self._gmsh.model.geo.mesh.setTransfiniteCurve(tag, division.count + 1, "Progression", 1.0)
        self._curves[p, q] = tag
        self._curves[q, p] = -tag
        self._divisions[tag] = division

    def face(self, corners: Sequence[int], sphere: int | None = None) -> int:
        """Four-sided face through `corners` in cyclic order, on the sphere about a point if given.

        Returns the face's tag, which is the same if it is asked for again with the same corners.
        """
        key = frozenset(corners)
        if key not in self._faces:
            geo = self._gmsh.model.geo
            sides = [
                self._curves[a, b] for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)
            ]
            counts = [self._divisions[abs(side)].count for side in sides]
            if counts[0] != counts[2] or counts[1] != counts[3]:
                raise AssertionError(f"opposite sides of a block differ: {counts}")
            loop = geo.addCurveLoop(sides)
            tag = geo.addSurfaceFilling([loop], sphereCenterTag=-1 if sphere is None else sphere)
            geo.mesh.setTransfiniteSurface(tag, cornerTags=list(corners))
            geo.mesh.setRecombine(2, tag)
            self._faces[key] = tag
        return self._faces[key]

    def hexahedron(self, start: Sequence[int], end: Sequence[int]) -> None:
        """Block between two faces given by corresponding corners; missing faces are added."""
        faces = [self.face(start), self.face(end)]
        for i in range(4):
            j = (i + 1) % 4
            faces.append(self.face((start[i], start[j], end[j], end[i])))
        geo = self._gmsh.model.geo
        tag = geo.addVolume([geo.addSurfaceLoop(faces)])
        geo.mesh.setTransfiniteVolume(tag, cornerTags=[*start, *end])

    def find_curve(self, p: int, q: int) -> int:
        """Tag of the curve between two points."""
        return abs(self._curves[p, q])

    def generate(self, dim: int) -> tuple[Floats, Ints]:
        """Mesh the blocks: points (n, 3) in mm and cells (m, 8 or 4) that index them.

        Raises MeshError: gmsh fails, or returns anything but hexahedra (3D) or quadrilaterals (2D).
        """
        gmsh = self._gmsh
        gmsh.model.geo.synchronize()
        try:
            gmsh.model.mesh.generate(1)
            for tag, division in self._divisions.items():
                if division.nodes:
                    self._place(tag, division.nodes)
            gmsh.model.mesh.generate(dim)
        except Exception as error:  # gmsh raises the bare class
            raise MeshError(f"gmsh could not mesh the finger: {error}") from error
        types, _, nodes = gmsh.model.mesh.getElements(dim)
        if list(types) != [{2: 3, 3: 5}[dim]]:
            raise MeshError(f"gmsh returned element types {list(types)} instead of one block type")
        members = nodes[0].astype(np.int64)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        # gmsh makes a node of every point, the arcs' centres too, which no element uses.
        used = np.isin(tags, members)
        self._index = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
        self._index[tags[used]] = np.arange(np.count_nonzero(used))
        return coordinates.reshape(-1, 3)[used], self._index[members].reshape(-1, 2**dim)

    def _place(self, tag: int, shares: Sequence[float]) -> None:
        """Move the inner nodes of a meshed line or arc, whose parameter is linear in its length."""
        mesh = self._gmsh.model.mesh
        nodes, _, parameters = mesh.getNodes(1, tag)
        for node, share in zip(nodes[np.argsort(parameters)], shares, strict=True):
            mesh.setNode(node, self._gmsh.model.getValue(1, tag, [share]), [share])

    def nodes_on(self, dim: int, tags: Sequence[int]) -> Ints:
        """Sorted indices of the nodes on curves (dim 1) or faces (dim 2), ends included."""
        found = [self._gmsh.model.mesh.getNodes(dim, tag, includeBoundary=True)[0] for tag in tags]
        return np.unique(self._index[np.concatenate(found).astype(np.int64)])
