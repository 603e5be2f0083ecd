"""Draws one run: ``python -m validation.render_worker RUN_FOLDER OUT PREFIX`` (see ``renders``)."""

import json
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np

from validation.storage import atomic

FRAMES = 6
SIZE = (1000, 640)
SURFACE_COLOR, EDGE_COLOR = "#c9c4ba", "#5a5a5a"


def read_steps(folder: Path) -> list[tuple[float, Path]]:
    """Times and files of a PVD collection."""
    root = ElementTree.parse(folder / "tap.pvd").getroot()
    return [
        (float(entry.attrib["timestep"]), folder / entry.attrib["file"])
        for entry in root.iter("DataSet")
    ]


def deformed(path: Path) -> Any:
    """The deformed body of one step, a half model mirrored to the full one."""
    import pyvista as pv

    mesh = pv.read(path)
    mesh["speed"] = np.linalg.norm(mesh["velocity"], axis=1)
    mesh["von Mises stress (MPa)"] = mesh.cell_data.pop("von_mises_Pa") / 1e6
    mesh["speed (m/s)"] = mesh.point_data.pop("speed")
    depth = float(np.ptp(mesh.points[:, 2]))
    mesh.points += mesh["displacement"]
    if depth > 0:
        mesh = pv.merge([mesh, mesh.reflect((0, 0, 1), point=(0, 0, 0))], merge_points=False)
    return mesh.extract_surface(algorithm="dataset_surface")


def _scene(plotter: Any, mesh: Any, height: float, zoom: bool) -> None:
    """Surface plane, scale bar and camera; shared by all pictures."""
    import pyvista as pv

    low, high = np.asarray(mesh.bounds)[[0, 2, 4]], np.asarray(mesh.bounds)[[1, 3, 5]]
    radius = max(float(high[2] - low[2]) / 2, 0.002)
    tip = mesh.points[np.argmin(mesh.points[:, 1])]
    if zoom:
        focus = np.array([tip[0] + 0.2 * radius, -height + 1.0 * radius, 0.0])
        half_view = 1.9 * radius
        bar = 0.005
    else:
        focus = (low + high) / 2
        focus[1] = (high[1] - height) / 2
        half_view = 0.62 * max(float(high[1] + height), 0.7 * float(high[0] - low[0]))
        bar = 0.02
    plane = pv.Plane(
        center=(focus[0], -height, 0),
        direction=(0, 1, 0),
        i_size=6 * half_view,
        j_size=6 * radius,
    )
    plotter.add_mesh(plane, color=SURFACE_COLOR, ambient=0.4)
    start = np.array([focus[0] - 1.35 * half_view, -height - 0.42 * half_view, 3 * radius])
    plotter.add_mesh(
        pv.Line(start, start + np.array([bar, 0, 0])), color="black", line_width=4, lighting=False
    )
    plotter.add_point_labels(
        [start + np.array([bar / 2, 0.05 * half_view, 0])],
        [f"{bar * 1e3:g} mm"],
        shape=None,
        show_points=False,
        font_size=18,
        text_color="black",
        always_visible=True,
        justification_horizontal="center",
    )
    away = np.array([0.0, 0.12, 1.0])
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + away
    plotter.camera.up = (0, 1, 0)
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = half_view
    plotter.set_background("white")


def draw(
    path: Path, mesh: Any, field: str, text: str, height: float, *, zoom: bool, limits: Any = None
) -> None:
    """One picture of one field."""
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, window_size=list(SIZE))
    stress = field.startswith("von Mises")
    plotter.add_mesh(
        mesh,
        scalars=field,
        cmap="inferno" if stress else "viridis",
        clim=limits,
        show_edges=zoom,
        edge_color=EDGE_COLOR,
        line_width=0.5,
        scalar_bar_args={
            "title": field,
            "color": "black",
            "vertical": False,
            "position_x": 0.33,
            "position_y": 0.02,
            "width": 0.34,
            "height": 0.08,
            "title_font_size": 18,
            "label_font_size": 16,
            "n_labels": 4,
        },
    )
    _scene(plotter, mesh, height, zoom)
    plotter.add_text(text, position="upper_left", font_size=11, color="black")
    with atomic(path) as temporary:
        plotter.screenshot(str(temporary))
    plotter.close()


def contact_sheet(path: Path, pictures: list[Path], columns: int) -> None:
    """Several pictures as one, reduced in size."""
    from PIL import Image

    width, height = SIZE[0] * 2 // 3, SIZE[1] * 2 // 3
    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (columns * width, rows * height), "white")
    for number, picture in enumerate(pictures):
        with Image.open(picture) as image:
            tile = image.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)
        sheet.paste(tile, (number % columns * width, number // columns * height))
    with atomic(path) as temporary:
        sheet.quantize(192).save(temporary, format="PNG", optimize=True)


def shrink(path: Path) -> None:
    """Store a picture with a palette: a quarter of the bytes, no visible difference."""
    from PIL import Image

    with Image.open(path) as image:
        small = image.convert("RGB").quantize(192)
    with atomic(path) as temporary:
        small.save(temporary, format="PNG", optimize=True)


def main(run_folder: Path, out: Path, prefix: str) -> None:
    """Draw stress and velocity at peak force, and a sequence of the tap."""
    summary = json.loads((run_folder / "summary.json").read_text(encoding="utf-8"))
    import tomllib

    height = tomllib.loads(summary["provenance"]["scene_toml"])["surface"]["height"]
    contact = summary["contact_time_s"] or 0.0
    steps = read_steps(run_folder / "fields")
    peak_time = contact + (summary["peak_normal_force_time_s"] or 0.0)
    peak = min(steps, key=lambda step: abs(step[0] - peak_time))
    title = f"{summary['scene']} finger, {summary['model']} {summary['variant']}"

    def moment(time: float) -> str:
        return f"t - t_c = {(time - contact) * 1e6:.0f} us"

    mesh = deformed(peak[1])
    text = f"{title}\n{moment(peak[0])} (peak force)"
    for what, field in (("stress", "von Mises stress (MPa)"), ("velocity", "speed (m/s)")):
        path = out / f"{prefix}-{what}.png"
        draw(path, mesh, field, text, height, zoom=what == "stress")
        shrink(path)
    limit = float(np.percentile(mesh["von Mises stress (MPa)"], 99.5))
    chosen = [steps[round(i)] for i in np.linspace(0, len(steps) - 1, min(FRAMES, len(steps)))]
    frames = []
    for number, (time, file) in enumerate(chosen):
        frame = out / f".{prefix}-frame-{number}.png"
        draw(
            frame,
            deformed(file),
            "von Mises stress (MPa)",
            moment(time),
            height,
            zoom=True,
            limits=(0, limit or 1.0),
        )
        frames.append(frame)
    contact_sheet(out / f"{prefix}-sequence.png", frames, columns=3)
    for frame in frames:
        frame.unlink()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
