"""Draws one run: ``python -m validation.render_worker RUN_FOLDER OUT PREFIX`` (see ``renders``)."""

import json
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np

from validation.storage import atomic

FRAMES = 6
SCALE_PERCENTILE = 99.7
EDGES_UP_TO = 5000  # faces: beyond this, edges hide the colours
GAP = 6  # pixels between the frames of a sheet
SIZE = (1000, 640)
STRESS, SPEED = "von Mises stress (MPa)", "speed (m/s)"
SURFACE_COLOR, EDGE_COLOR = "#d8d4cc", "#808080"
BAR = {
    "color": "black",
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


def read_steps(folder: Path) -> list[tuple[float, Path]]:
    """Times and files of a PVD collection."""
    root = ElementTree.parse(folder / "tap.pvd").getroot()
    return [
        (float(entry.attrib["timestep"]), folder / entry.attrib["file"])
        for entry in root.iter("DataSet")
    ]


def deformed(path: Path, cut: bool) -> Any:
    """Surface of the deformed body of one step.

    Parameters
    ----------
    cut : whether to keep only the far half of a half model, so that the plane of motion with the
        stress inside the body faces the camera; otherwise the half is completed by its mirror.
    """
    import pyvista as pv

    mesh = pv.read(path)
    mesh[STRESS] = mesh.cell_data.pop("von_mises_Pa") / 1e6
    mesh[SPEED] = np.linalg.norm(mesh["velocity"], axis=1)
    mesh.points += mesh["displacement"]
    if np.ptp(mesh.points[:, 2]) > 0:
        far_half = mesh.reflect((0, 0, 1), point=(0, 0, 0))
        mesh = far_half if cut else pv.merge([mesh, far_half], merge_points=False)
    return mesh.extract_surface(algorithm="dataset_surface")


def _surface_and_camera(plotter: Any, mesh: Any, height: float, zoom: bool) -> None:
    """The tapped surface, a scale bar, and a side view that shows the surface edge-on."""
    import pyvista as pv

    x_low, x_high, y_low, y_high = np.asarray(mesh.bounds)[:4]
    del y_low
    tip = mesh.points[np.argmin(mesh.points[:, 1])]
    radius = float(np.ptp(mesh.points[np.abs(mesh.points[:, 0] - tip[0]) < 1e-3, 1])) / 2
    radius = min(max(radius, 1e-4), float(x_high - x_low))
    if zoom:
        half_view, bar, center = 1.6 * radius, 0.002, float(tip[0]) + 0.6 * radius
    else:
        half_view = 0.66 * max(float(y_high) + height, 0.6 * float(x_high - x_low))
        bar, center = 0.02, float(x_low + x_high) / 2
    focus = np.array([center, -height + 0.5 * half_view, 0.0])
    far = 8 * half_view
    slab = (center - far, center + far, -height - far, -height, -far, -1e-4 * half_view)
    plotter.add_mesh(pv.Box(slab), color=SURFACE_COLOR, lighting=False)
    start = focus + half_view * np.array([-1.45, -0.78, 2.0])
    end = start + np.array([bar, 0, 0])
    plotter.add_mesh(pv.Line(start, end), color="black", line_width=5, lighting=False)
    plotter.add_point_labels(
        [(start + end) / 2 + np.array([0, 0.05 * half_view, 0])],
        [f"{bar * 1e3:g} mm"],
        shape=None,
        show_points=False,
        font_size=20,
        text_color="black",
        always_visible=True,
        justification_horizontal="center",
    )
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + np.array([0, 0, far])
    plotter.camera.up = (0, 1, 0)
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = half_view
    plotter.camera.clipping_range = (0.1 * far, 3 * far)
    plotter.set_background("white")


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
) -> None:
    """One picture of one field, stored whole or not at all."""
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, window_size=list(SIZE))
    plotter.add_mesh(
        mesh,
        scalars=field,
        cmap="inferno" if field == STRESS else "viridis",
        clim=limits,
        show_edges=zoom and mesh.n_cells < EDGES_UP_TO,
        edge_color=EDGE_COLOR,
        edge_opacity=0.35,
        line_width=0.5,
        lighting=not zoom,
        ambient=0.4,
        show_scalar_bar=with_bar,
        scalar_bar_args={**BAR, "title": f"{field}\n"} if with_bar else None,
    )
    _surface_and_camera(plotter, mesh, height, zoom)
    plotter.add_text(text, position="upper_left", font_size=12, color="black")
    with atomic(path) as temporary:
        plotter.screenshot(str(temporary))
    plotter.close()
    _compress(path)


def _compress(path: Path) -> None:
    """Store a screenshot with the best compression."""
    from PIL import Image

    with Image.open(path) as image, atomic(path) as temporary:
        image.convert("RGB").save(temporary, format="PNG", optimize=True)


def contact_sheet(path: Path, pictures: list[Path], columns: int) -> None:
    """Several pictures as one, reduced in size."""
    from PIL import Image

    width, height = SIZE[0] // 2, SIZE[1] // 2
    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (columns * (width + GAP) - GAP, rows * (height + GAP) - GAP), "white")
    for number, picture in enumerate(pictures):
        with Image.open(picture) as image:
            tile = image.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)
        sheet.paste(tile, (number % columns * (width + GAP), number // columns * (height + GAP)))
    with atomic(path) as temporary:
        sheet.save(temporary, format="PNG", optimize=True)


def main(run_folder: Path, out: Path, prefix: str) -> None:
    """Draw stress and velocity at peak force, and a sequence of the tap."""
    summary = json.loads((run_folder / "summary.json").read_text(encoding="utf-8"))
    height = tomllib.loads(summary["provenance"]["scene_toml"])["surface"]["height"]
    contact = summary["contact_time_s"] or 0.0
    steps = read_steps(run_folder / "fields")
    peak_time = contact + (summary["peak_normal_force_time_s"] or 0.0)
    peak = min(steps, key=lambda step: abs(step[0] - peak_time))
    title = f"{summary['scene']} finger, {summary['model']} {summary['variant']}"

    def moment(time: float) -> str:
        return f"t - t_c = {(time - contact) * 1e6:.0f} µs"

    def picture(what: str) -> Path:
        return out / f"{prefix}-{what}.png"

    inside, whole = deformed(peak[1], cut=True), deformed(peak[1], cut=False)
    text = f"{title}\n{moment(peak[0])} (peak force)"
    # A few elements at the contact would leave the rest black: the scale ends below them.
    limits = (0.0, float(np.percentile(inside[STRESS], SCALE_PERCENTILE)) or 1.0)
    largest = f"{text}\nlargest {np.max(inside[STRESS]):.3g} MPa, beyond the scale"
    draw(picture("stress"), inside, STRESS, largest, height, zoom=True, limits=limits)
    speeds = (0.0, float(np.max(whole[SPEED])) or 1.0)
    draw(picture("velocity"), whole, SPEED, text, height, zoom=False, limits=speeds)

    indices = np.linspace(0, len(steps) - 1, min(FRAMES, len(steps))).round().astype(int)
    frames = []
    for number, index in enumerate(indices):
        time, file = steps[index]
        frames.append(out / f".{prefix}-frame-{number}.png")
        draw(
            frames[-1],
            deformed(file, cut=True),
            STRESS,
            moment(time),
            height,
            zoom=True,
            limits=limits,
            with_bar=number == len(indices) - 1,
        )
    contact_sheet(picture("sequence"), frames, columns=3)
    for frame in frames:
        frame.unlink()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
