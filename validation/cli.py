"""The command ``fingertap``: its commands by where they are, and how every one of them ends.

A command's module is imported when the command is called: ``fingertap --help`` loads none of them.
"""

import gc
import os
import sys
from collections.abc import Sequence

import cyclopts

from validation.errors import OutsideToleranceError, RunFailedError, UserError, file_reason

KEPT = "finished runs and files already written, if any, are kept"
GARBAGE_AFTER = 100_000  # new containers between two looks for garbage

app = cyclopts.App(
    name="fingertap",
    help="Cross-validation of a reduced model and finite elements: a soft finger taps a surface.",
    version="0.1.0",
    suppress_keyboard_interrupt=False,
)
COMMANDS = {  # by name: the function below `validation` that each calls, and what it does
    "run": ("runs.command:run_scene", "Run one model on one scene."),
    "compare": ("compare.command:compare",
        "Run one model on a scene with and without a change, and say what it changes."),
    "render": ("render.command:render",
        "Draw stress, velocity, contact pressure, deformation, a sequence and an animation."),
    "validate": ("validate.command:run_validation",
        "Compare models on scenes, by default the paper's: tables, figures, renders, one page."),
    "new": ("scenes.command:new_scene", "Write a commented scene to start from."),
    "schema": ("scenes.command:print_schema",
        "Print the JSON Schema of a scene: keys, units, bounds, defaults."),
    "paper": ("studies.paper.command:run_paper",
        "Compute every number and figure of the article, and judge each one."),
    "waterfall": ("studies.assumptions.waterfall_command:waterfall",
        "Say what each assumption of the reduced model is worth on a scene."),
    "study": ("studies.assumptions.study_command:study",
        "Say what each assumption is worth over many fingers, and how often the model is right."),
    "converge": ("converge.command:run_converge",
        "Refine mesh, penalty and step of the reference one by one; state its error bar.\n\n"
        "All runs start from one impact state. Runs are kept: a stopped study goes on."),
    "evidence": ("studies.evidence.command:evidence",
        "Compare numbers computed or measured by others with ours, element to tap; judge each."),
    "bench": ("studies.bench.command:bench",
        "Measure time against error; --skips: what each shortcut saves; --peers: other codes."),
    "stress": ("studies.stress.command:run_stress",
        "Map where the models are right, refuse, or stop; no cell may be silently wrong.\n\n"
        "Finished cells are kept: a stopped campaign goes on."),
    "calibrate": ("studies.calibration.command:calibrate",
        "Solve random scenes tightly too: do the errors that runs state match the true ones?\n\n"
        "Finished scenes are kept: a stopped campaign goes on."),
    "sweep": ("sweep.command:run_sweep",
        "Solve many scenes by models: a dataset, a page; here or on a Dask cluster.\n\n"
        "Finished runs are kept: a stopped sweep goes on."),
}  # fmt: skip
IDENTIFY = {
    "contact": ("identify.contact_command:run_identify_contact",
        "Press the meshed tip on the surface: k and eta^2, beside Hertz, Mindlin and the paper."),
    "torque": ("studies.paper.torque_factor:run_identify_torque",
        "Find the unit of the paper's printed t_3 from its three arrival times."),
    "ramp": ("studies.paper.ramp_outcome:run_identify_ramp",
        "Drive the paper's fingers by a damped ramp: do figs. 13 to 16 agree together?\n\n"
        "Takes some ten minutes on two cores; nothing of a stopped one is kept."),
}  # fmt: skip
identify = cyclopts.App(name="identify", help="Parameters that the reduced model needs.")
for group, commands in ((app, COMMANDS), (identify, IDENTIFY)):
    for name, (function, what) in commands.items():
        group.command(f"validation.{function}", name=name, help=what)
app.command(identify)
app.register_install_completion_command(help="Let the shell complete commands and options.")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; exit code 0 done, 1 a run failed, 2 bad input, 3 outside."""
    from validation.harness.console import say_error
    from validation.harness.interrupts import heard_interrupts
    from validation.harness.surroundings import open_closed_streams, refuse_unusable_surroundings

    open_closed_streams()
    # as `reference_fem.compiled` does where it is imported: by then stored results are looked for,
    # which are known by the environment too
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    # what is imported stays: looking for garbage in it takes a tenth of a short command's time
    gc.set_threshold(GARBAGE_AFTER)
    code = RunFailedError.exit_code
    try:
        refuse_unusable_surroundings()
        with heard_interrupts():
            app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        return
    except (UserError, RunFailedError, OutsideToleranceError) as error:
        text, code = str(error), error.exit_code
    except cyclopts.CycloptsError as error:
        text, code = f"{error}; see fingertap --help", UserError.exit_code
    except BrokenPipeError:  # whoever read the output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return
    except OSError as error:
        text = f"{file_reason(error)}; {KEPT}: when that is fixed, give the same command again"
    except MemoryError:
        text = f"out of memory; {KEPT}: use a smaller scene or a larger limit"
    except KeyboardInterrupt as error:
        by = f" by {error}" if str(error) else ""
        text = f"interrupted{by}; {KEPT}"
    say_error(text)
    sys.exit(code)
