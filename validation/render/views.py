"""Parts of a picture: the deformed body, the surface, camera and colours, contact sheets."""

from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from PIL import Image

from validation.harness.files import atomic
from validation.render.run_folder import check_fields

EDGES_UP_TO = 5000  # faces: beyond this, edges hide the colours
NEAR = 0.01  # over the body's diagonal: how far beside the lowest point its height is measured
GAP = 6  # pixels between the frames of a sheet
SIZE, HALF_SIZE = (1000, 640), (500, 320)
STRESS, SPEED = "von Mises stress (MPa)", "speed (m/s)"
PRESSURE, BENDING = "contact pressure (MPa)", "displacement beyond rigid motion (µm)"
COLORS = {STRESS: "inferno", SPEED: "viridis", PRESSURE: "magma", BENDING: "cividis"}
SURFACE_COLOR, EDGE_COLOR = "#d8d4cc", "#808080"
BAR = {
    "vertical": False,
    "position_x": 0.4,
    "position_y": 0.03,
    "width": 0.5,
    "height": 0.1,
    "title_font_size": 20,
    "label_font_size": 18,
    "n_labels": 4,
    "fmt": "%.3g",
}


def read_fields(path: Path) -> Any:
    """The undeformed body with the fields of a step."""
    try:
        mesh = pv.read(path)
    except Exception:  # VTK's readers raise all kinds of exceptions
        mesh = pv.UnstructuredGrid()  # has no fields, so that it is refused
    check_fields(path, mesh)
    return mesh


def deformed(path: Path, cut: bool) -> Any:
    """Surface of the deformed body of one step; see `surface` for `cut`."""
    mesh = read_fields(path)
    mesh[STRESS] = mesh.cell_data.pop("von_mises_Pa") / 1e6
    mesh[SPEED] = np.linalg.norm(mesh["velocity"], axis=1)
    if "contact_pressure_Pa" in mesh.point_data:
        mesh[PRESSURE] = mesh.point_data.pop("contact_pressure_Pa") / 1e6
    mesh.points += mesh["displacement"]
    return surface(mesh, cut)


def surface(mesh: Any, cut: bool) -> Any:
    """Surface of a body.

    cut : whether to keep only the far half of a half model, so that the plane of motion with the
        stress inside the body faces the camera; otherwise the half is completed by its mirror.
    """
    low, high = mesh.bounds[4:]
    if low < -0.5 * high:  # the whole body
        behind = mesh.cell_centers().points[:, 2] < 0.0
        mesh = mesh.extract_cells(np.flatnonzero(behind)) if cut else mesh
    elif high > low:
        far_half = mesh.reflect((0, 0, 1), point=(0, 0, 0))
        mesh = far_half if cut else pv.merge([mesh, far_half], merge_points=False)
    return mesh.extract_surface(algorithm="dataset_surface")


def lowest_x(mesh: Any) -> float:
    """X of the lowest point."""
    return float(mesh.points[np.argmin(mesh.points[:, 1]), 0])


def _surface_and_camera(
    plotter: Any, mesh: Any, height: float, zoom: bool, look_at: float | None
) -> None:
    """Add the tapped surface and a scale bar, and look from the side, at the surface edge-on.

    Zoomed in, the view is centred a little beside the lowest point, whose X may be given.
    """
    x_low, x_high, _, y_high = np.asarray(mesh.bounds)[:4]
    tip_x = lowest_x(mesh) if look_at is None else look_at
    near = NEAR * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    beside = np.abs(mesh.points[:, 0] - lowest_x(mesh)) < near
    radius = min(max(float(np.ptp(mesh.points[beside, 1])) / 2, 0.1 * near), float(x_high - x_low))
    if zoom:
        half_view, center = 1.6 * radius, tip_x + 0.6 * radius
    else:
        half_view = 0.7 * max(float(y_high) + height, 0.6 * float(x_high - x_low))
        center = float(x_low + x_high) / 2
    focus = np.array([center, -height + 0.5 * half_view, 0.0])
    far = 8 * half_view
    slab = (center - far, center + far, -height - far, -height, -far, -1e-4 * half_view)
    plotter.add_mesh(pv.Box(slab), color=SURFACE_COLOR, lighting=False)
    start = focus + half_view * np.array([-1.45, -0.78, 2.0])
    scale_bar(plotter, start, half_view / 4, np.array([0, 0.05 * half_view, 0]), "black")
    look(plotter, focus, np.array([0, 0, far]), (0, 1, 0), half_view, (0.1 * far, 3 * far))
    plotter.set_background("white")


def scale_bar(plotter: Any, start: Any, length: float, label: Any, color: str) -> None:
    """Add a line of about this length, m, along X; `label` is its label's offset from its middle,
    m.
    """
    length = float(f"{length:.1g}")
    end = start + np.array([length, 0, 0])
    plotter.add_mesh(pv.Line(start, end), color=color, line_width=5, lighting=False)
    plotter.add_point_labels(
        [(start + end) / 2 + label],
        [f"{length * 1e3:g} mm"],
        shape=None,
        show_points=False,
        font_size=20,
        text_color=color,
        always_visible=True,
        justification_horizontal="center",
    )


def look(
    plotter: Any,
    focus: Any,
    away: Any,
    up: tuple[int, int, int],
    half_view: float,
    clipping: tuple[float, float],
) -> None:
    """Look at `focus` from `away` of it, in parallel projection of height 2 half_view, m."""
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + away
    plotter.camera.up = up
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = half_view
    plotter.camera.clipping_range = clipping


def show_field(
    plotter: Any, mesh: Any, field: str, limits: tuple[float, float], edges: bool, text_color: str,
    **style: Any,
) -> None:  # fmt: skip
    """Add a body coloured by a field, on request with its elements' edges."""
    bar = {**BAR, "title": f"{field}\n", "color": text_color}
    plotter.add_mesh(
        mesh, scalars=field, cmap=COLORS[field], clim=limits, show_edges=edges,
        edge_color=EDGE_COLOR, line_width=0.5, scalar_bar_args=bar, **style,
    )  # fmt: skip


def draw(
    path: Path,
    mesh: Any,
    field: str,
    text: str,
    height: float,
    *,
    zoom: bool,
    limits: tuple[float, float],
    with_bar: bool = True,
    look_at: float | None = None,
    shadow: Any = None,
) -> None:
    """Draw one picture of one field."""
    plotter = pv.Plotter(off_screen=True, window_size=list(SIZE))
    if shadow is not None:
        plotter.add_mesh(shadow, color=EDGE_COLOR, lighting=False)
    style = {
        "edge_opacity": 0.35,
        "lighting": not zoom,
        "ambient": 0.4,
        "show_scalar_bar": with_bar,
    }
    show_field(plotter, mesh, field, limits, zoom and mesh.n_cells < EDGES_UP_TO, "black", **style)
    _surface_and_camera(plotter, mesh, height, zoom, look_at)
    plotter.add_text(text, position="upper_left", font_size=12, color="black")
    screenshot(plotter, path)


def screenshot(plotter: Any, path: Path) -> None:
    """Store what a plotter shows, with the best compression, and close it."""
    with atomic(path) as temporary:
        plotter.screenshot(str(temporary))
    plotter.close()
    with Image.open(path) as image, atomic(path) as temporary:
        image.convert("RGB").save(temporary, format="PNG", optimize=True)


def reduced(path: Path) -> Any:
    """A picture at half its size."""
    with Image.open(path) as image:
        return image.convert("RGB").resize(HALF_SIZE, Image.Resampling.LANCZOS)


def contact_sheet(path: Path, pictures: list[Path], columns: int) -> None:
    """Write several pictures as one, each at half its size."""
    width, height = HALF_SIZE
    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (columns * (width + GAP) - GAP, rows * (height + GAP) - GAP), "white")
    for number, picture in enumerate(pictures):
        row, column = divmod(number, columns)
        sheet.paste(reduced(picture), (column * (width + GAP), row * (height + GAP)))
    with atomic(path) as temporary:
        sheet.save(temporary, format="PNG", optimize=True)
