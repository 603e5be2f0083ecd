"""``fingertap identify contact``: k and eta^2 of a scene's tip, as table, plot and JSON."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from validation.harness.command_line import AsJson, Overrides, Source
from validation.harness.console import output, progress_bar, say
from validation.harness.figures import BLACK, BLUE, GREY, ORANGE, panels
from validation.harness.files import exclusive_folder, json_text, safe_name, write_json
from validation.harness.tables import table_of, write_table
from validation.harness.uncertainty import with_error
from validation.identify.contact import ContactIdentification, identify_contact, value_to_use
from validation.scenes.load import load_scene

COLUMNS = ("quantity", "unit", "static_indentation", "uncertainty", "theory", "theory_is", "scene")


def rows(found: ContactIdentification) -> list[dict[str, Any]]:
    """The identified values beside theory and the scene's own."""
    theory = 1.25 * found.force_N / found.hertz_N_per_m
    own, round_end = (
        f"{where} touching at {90.0 - abs(angle):.1f} degrees"
        for where, angle in (
            ("the end of the axis", found.touch_angle_deg),
            ("the lowest point of the round end", found.round_touch_angle_deg),
        )
    )
    return [
        {
            "quantity": f"k, the spring of the same energy at F = {found.force_N:.4g} N, {own}",
            "unit": "N/m",
            "static_indentation": found.normal_stiffness_N_per_m,
            "uncertainty": found.stiffness and found.stiffness.error,
            "theory": found.hertz_N_per_m,
            "theory_is": "Hertz, 5 F/(4 delta)",
            "scene": found.scene_normal_stiffness_N_per_m,
        },
        {
            "quantity": "eta^2, normal over tangential stiffness there, sticking",
            "unit": "1",
            "static_indentation": found.eta_squared,
            "uncertainty": found.ratio and found.ratio.error,
            "theory": found.mindlin_eta_squared,
            "theory_is": "Mindlin, (2 - nu)/(2 (1 - nu))",
            "scene": found.scene_eta_squared,
        },
        {
            "quantity": "indentation at that force",
            "unit": "m",
            "static_indentation": found.levels[-1].indentation_m,
            "theory": theory,
            "theory_is": "Hertz",
        },
        *(
            {
                "quantity": f"{key}, for solver.hcm.assumptions = 'refined', {round_end}",
                "unit": "1",
                "static_indentation": value_to_use(judged),
                "uncertainty": judged.error,
            }
            for key, judged in found.yielding.items()
        ),
    ]


def to_json(found: ContactIdentification) -> dict[str, Any]:
    """The object that ``--json`` prints and the file holds."""
    yielding = found.yielding
    return {
        **{key: value for key, value in asdict(found).items() if key not in ("stiffness", "ratio")},
        "normal_stiffness_uncertainty_N_per_m": found.stiffness and found.stiffness.error,
        "normal_stiffness_verdict": found.stiffness and found.stiffness.verdict,
        "eta_squared_uncertainty": found.ratio and found.ratio.error,
        "eta_squared_verdict": found.ratio and found.ratio.verdict,
        "tip_compliance_limit": {key: value_to_use(of) for key, of in yielding.items()},
        "tip_compliance_uncertainty": {key: of.error for key, of in yielding.items()},
        "tip_compliance_verdict": {key: of.verdict for key, of in yielding.items()},
        "tangential_ratio": 1 / found.eta_squared,
        "reference_section": "through the hemisphere's centre, best-fit rigid motion",
    }


def draw(path: Path, found: ContactIdentification) -> None:
    """Draw force over indentation: statics, Hertz, and the linear springs."""
    force, top = found.curve["force_N"], 1.15 * found.force_N
    with panels(path, 1, width=5.2, height=3.6) as ((axis,),):
        for key, color, line, name in (
            ("indentation_m", BLACK, "-", "static indentation"),
            ("hertz_indentation_m", BLUE, "--", "Hertz"),
        ):
            axis.plot(1e6 * np.array(found.curve[key]), force, color=color, ls=line, label=name)
        for stiffness, color, name in (
            (found.normal_stiffness_N_per_m, ORANGE, "spring of the same energy"),
            (found.scene_normal_stiffness_N_per_m, GREY, "the scene's k"),
        ):
            if stiffness is None:
                continue
            axis.plot([0, 1e6 * top / stiffness], [0, top], color=color, lw=1, label=name)
        axis.axhline(found.force_N, color=BLACK, lw=0.6, ls=":")
        axis.set(xlabel="indentation (µm)", ylabel="normal force (N)", xlim=(0, None))
        axis.set_ylim(0, None)
        axis.set_title(f"{found.scene} finger: the meshed tip on a rigid plane", loc="center")
        axis.legend()


def run_identify_contact(
    scene: Source,
    /,
    *,
    overrides: Overrides = (),
    as_json: AsJson = False,
    out: Path = Path("out"),
) -> None:
    """Identify, write, print.

    Parameters
    ----------
    out
        Folder for identify/: contact-SCENE as CSV, Markdown, LaTeX, JSON and PNG.
    """
    named = load_scene(scene, overrides)
    name = safe_name(f"contact-{named.name}")
    title = f"Contact of the {named.name} finger's tip, from static indentation"
    with exclusive_folder(out / "identify") as folder:
        with progress_bar(f"identify contact {named.name}") as progress:
            found = identify_contact(named, progress=progress)
        table = rows(found)
        write_table(folder, name, table_of(table, COLUMNS), title)
        write_json(folder / f"{name}.json", to_json(found))
        draw(folder / f"{name}.png", found)
    for caution in found.cautions:
        say(f"caution: {caution}")
    if as_json:
        output(json_text(to_json(found)))
        return
    output(f"{named.name}: {title.lower()}")
    for row in table:
        known = with_error(row["static_indentation"], row.get("uncertainty"), 4)
        theory = f"{row['theory_is']}: {row['theory']:.4g}" if "theory" in row else ""
        given = f"; the scene's own: {row['scene']:.4g}" if row.get("scene") is not None else ""
        unit = "" if row["unit"] == "1" else f" {row['unit']}"
        output(f"  {row['quantity']}: {known}{unit}" + f" ({theory}{given})" * bool(theory))
    for what, judged in {"k": found.stiffness, "eta^2": found.ratio, **found.yielding}.items():
        if judged is not None:
            output(f"  {what}, three meshes: {judged.verdict}")
    output(f"  files in {folder}")
