"""Pictures beside stress and velocity: contact patch, enlarged deformation, animation."""

from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from PIL import Image
from scipy.spatial.transform import Rotation

from validation.harness.files import atomic
from validation.render import views

ENLARGED = 0.2  # largest drawn displacement beyond rigid motion, over the finger's diameter
PATCH_VIEW = 1.6  # half the view's height over the patch's half width
FRAME_MS, LAST_FRAME_MS = 120, 1200


def draw_patch(path: Path, mesh: Any, text: str, height: float) -> None:
    """Draw the contact pressure on the body, looking up from the surface.

    A plane body has no underside and is drawn from the side.
    """
    pressure = mesh[views.PRESSURE]
    largest = float(np.max(pressure))
    limits = (0.0, largest or 1.0)
    if np.ptp(mesh.points[:, 2]) == 0.0:
        views.draw(path, mesh, views.PRESSURE, text, height, zoom=True, limits=limits)
        return
    # the nodes that both halves of a completed body have count once
    pressed = np.unique(mesh.points[pressure > 0.0].round(9), axis=0)
    count = len(pressed)
    if not count:
        pressed = mesh.points[[np.argmin(mesh.points[:, 1])]]
    middle = 0.5 * (pressed.min(axis=0) + pressed.max(axis=0))
    edges = mesh.compute_cell_sizes(length=False, volume=False)["Area"]
    near = np.linalg.norm(mesh.cell_centers().points - middle, axis=1).argsort()[:8]
    element = float(np.sqrt(np.mean(edges[near])))
    half = PATCH_VIEW * (float(np.ptp(pressed[:, [0, 2]], axis=0).max()) / 2 + element)
    plotter = pv.Plotter(off_screen=True, window_size=list(views.SIZE))
    views.show_field(plotter, mesh, views.PRESSURE, limits, True, "white", lighting=False)
    below = np.array([0.0, -10 * half, 0.0])
    start = middle + below + np.array([-1.4 * half, 0.1 * half, -0.75 * half])
    views.scale_bar(plotter, start, half / 2, np.array([0, 0, 0.06 * half]), "white")
    views.look(plotter, middle, below, (0, 0, 1), half, (0.01 * half, 20 * half))  # X to the right
    plotter.set_background("black")
    text = f"{text}\nlargest {largest:.3g} MPa on {count} nodes, from below"
    plotter.add_text(text, position="upper_left", font_size=12, color="white")
    views.screenshot(plotter, path)


def beyond_rigid(rest: Any, now: Any, bodies: Any) -> Any:
    """Displacement of each point beyond its body's best-fit rigid motion, (n, 3), m.

    The rotation minimises sum |R X - x|^2 over the body's nodes (Kabsch, by the singular values
    of sum X x^T about the means).

    rest, now : (n, 3) positions before and after.
    bodies : (n,) number of the body that each point belongs to.
    """
    beyond = np.zeros_like(now)
    for body in np.unique(bodies):
        of_body = bodies == body
        before, after = rest[of_body], now[of_body]
        arms, turned = before - before.mean(axis=0), after - after.mean(axis=0)
        rotation, _ = Rotation.align_vectors(turned, arms)
        beyond[of_body] = turned - rotation.apply(arms)
    return beyond


def draw_shape(path: Path, file: Path, text: str, height: float) -> None:
    """Draw the finger with its deformation enlarged, in front of its rigid motion as a shadow."""
    mesh = views.read_fields(file)
    bodies = np.asarray(mesh.connectivity().point_data["RegionId"])
    rest, now = np.asarray(mesh.points), mesh.points + mesh["displacement"]
    mirror = np.array([1.0, 1.0, -1.0])  # a half model's phalanges are fitted as whole ones
    before, after = (np.vstack([points, points * mirror]) for points in (rest, now))
    beyond = beyond_rigid(before, after, np.tile(bodies, 2))[: len(now)]
    size = np.linalg.norm(beyond, axis=1)
    diameter = float(np.ptp(mesh.points[:, 1]))
    factor = float(f"{ENLARGED * diameter / (size.max() or 1.0):.1g}")
    mesh[views.BENDING] = size * 1e6
    moved, shadow = mesh.copy(), mesh.copy()
    moved.points, shadow.points = now + (factor - 1) * beyond, now - beyond
    body, shadow = views.surface(moved, cut=False), views.surface(shadow, cut=False)
    shadow.points[:, 2] -= 2 * diameter  # behind the body, so that it shows beside it
    limits = (0.0, float(size.max()) * 1e6 or 1.0)
    title = f"{text}\ndeformation enlarged {factor:g} times; rigid motion in grey"
    views.draw(path, body, views.BENDING, title, height, zoom=False, limits=limits, shadow=shadow)


def write_gif(path: Path, frames: list[Path]) -> None:
    """Write frames as a looping GIF of half their size with one palette; the last stays longer."""
    images = [views.reduced(frame) for frame in frames]
    palette = images[len(images) // 2].quantize(256)
    indexed = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    with atomic(path) as temporary:
        indexed[0].save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=indexed[1:],
            duration=[FRAME_MS] * (len(indexed) - 1) + [LAST_FRAME_MS],
            loop=0,
            optimize=False,
        )
