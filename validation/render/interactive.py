"""An interactive page of a tap: fields in 3D to turn, zoom and step through, forces below them.

It is one HTML file of about 5 MB that contains plotly's script and loads nothing. The extra `EXTRA`
installs plotly; pictures do not need it.
"""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.errors import UserError
from validation.harness.figures import BLACK, COLORS, GREY
from validation.harness.files import write_text

EXTRA = "interactive"
NARROW = '<meta name="viewport" content="width=device-width, initial-scale=1">'  # for phones
Curves = Mapping[str, NDArray[Any]]  # by label: time since the first touch (s), F_n, F_t (N)


def check_interactive(wanted: bool) -> None:
    """Raise UserError, before anything is run, if the page is wanted and plotly is missing."""
    if wanted and find_spec("plotly") is None:
        raise UserError(f"--interactive: needs plotly; pip install 'fingertap[{EXTRA}]'")


def write_interactive(
    path: Path,
    title: str,
    steps: Sequence[tuple[float, Any]],
    moments: Sequence[str],
    field: str,
    limits: tuple[float, float],
    height: float,
    curves: Curves,
) -> None:
    """Write the page.

    steps : times since the first touch, s, and the body's surface at each, m: always the same
        quadrilaterals, with the field on its cells. moments : these times in us, as shown
    limits : range of the field's colour scale.
    height : H, m.
    """
    import plotly.graph_objects as go

    a, b, c, d = np.asarray(steps[0][1].regular_faces).T
    triangles = {"i": np.append(a, a), "j": np.append(b, c), "k": np.append(c, d)}
    forces = np.concatenate([curve[1:].ravel() for curve in curves.values()])
    low, top = float(np.nanmin(forces)), float(np.nanmax(forces))

    def moving(time: float, mesh: Any) -> list[Any]:
        x, y, z = 1e3 * np.asarray(mesh.points, dtype=np.float32).T
        shown = np.tile(np.asarray(mesh[field], dtype=np.float32), 2)
        now = go.Scatter(x=[1e3 * time] * 2, y=[low, top])
        return [go.Mesh3d(x=x, y=y, z=z, intensity=shown), now]

    middle = len(steps) // 2
    first, now = moving(*steps[middle])
    first.update(triangles, intensitymode="cell", cmin=limits[0], cmax=limits[1], flatshading=True)
    bar = {"title": {"text": field, "side": "right"}, "y": 0.7, "len": 0.6}
    first.update(colorscale="Inferno", colorbar=bar)
    now.update(mode="lines", line={"color": GREY, "width": 1}, showlegend=False)
    x, _, z = (np.array([np.min(part), np.max(part)]) for part in (first.x, first.y, first.z))
    floor = go.Mesh3d(
        x=[x[0], x[1], x[1], x[0]], y=[-1e3 * height] * 4, z=[z[0], z[0], z[1], z[1]],
        i=[0, 0], j=[1, 2], k=[2, 3], color=GREY, opacity=0.4, hoverinfo="skip",
    )  # fmt: skip
    frames = [
        go.Frame(data=moving(*step), traces=[0, 1], name=f"{number}")
        for number, step in enumerate(steps)
    ]
    at_once = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}}
    slider = [
        {"label": moment, "method": "animate", "args": [[f"{number}"], at_once]}
        for number, moment in enumerate(moments)
    ]
    figure = go.Figure([first, now, floor, *_force_lines(curves)], frames=frames)
    figure.update_layout(_layout(title))
    figure.update_layout(
        xaxis_range=[1e3 * steps[0][0], 1e3 * steps[-1][0]],
        sliders=[
            {
                "active": middle,
                "currentvalue": {"prefix": "t - t<sub>c</sub> (µs) = "},
                "steps": slider,
                "pad": {"t": 45},
            }
        ],
    )
    shown = {"config": {"displaylogo": False, "responsive": True}, "default_height": "95vh"}
    page = figure.to_html(auto_play=False, **shown)
    write_text(path, page.replace("<head>", f"<head>{NARROW}", 1))


def _force_lines(curves: Curves) -> list[Any]:
    """F_n, and dotted F_t, of each curve."""
    import plotly.graph_objects as go

    lines = []
    for number, (label, (time, normal, tangential)) in enumerate(curves.items()):
        look = {"x": 1e3 * time, "mode": "lines", "legendgroup": label}
        color = COLORS[number % len(COLORS)]
        lines.append(go.Scatter(look, y=normal, name=label, line={"color": color}))
        dotted = {"color": color, "dash": "dot"}
        lines.append(go.Scatter(look, y=tangential, name=label, line=dotted, showlegend=False))
    return lines


def _layout(title: str) -> dict[str, Any]:
    """The fields above, the forces below them."""
    return {
        "title": {"text": title, "font": {"size": 15}},
        "template": "plotly_white",
        "font_color": BLACK,
        "scene_aspectmode": "data",
        "scene_domain": {"x": [0, 1], "y": [0.4, 1]},
        "scene_camera": {"up": {"x": 0, "y": 1, "z": 0}, "eye": {"x": 0, "y": 0.4, "z": 4}},
        "scene_xaxis_title_text": "X (mm)",
        "scene_yaxis_title_text": "Y (mm)",
        "scene_zaxis": {"title": {"text": ""}, "showticklabels": False},
        "xaxis_title_text": "t - t<sub>c</sub> (ms)",
        "yaxis": {"domain": [0, 0.32], "title": {"text": "F_n, dotted F_t (N)"}},
        "legend": {"orientation": "h", "y": 0.33, "yanchor": "bottom"},
        "margin": {"l": 60, "r": 20, "t": 50, "b": 40},
    }
