"""The errors that end a command, one exit code each, and the system's in words."""


class UserError(Exception):
    """Bad input: one line that names the key, its value, what is allowed and what to do."""

    exit_code = 2


class RunFailedError(Exception):
    """A run did not complete; what it had is kept and the message says where."""

    exit_code = 1


class OutsideToleranceError(Exception):
    """All runs completed, and a number is outside the tolerance that was asked for."""

    exit_code = 3


def reason(error: Exception) -> str:
    """Why, in the system's words where it was the system that refused, else in the error's."""
    return getattr(error, "strerror", None) or str(error)


def in_one_line(error: BaseException, most: int | None = None) -> str:
    """An error's message without line breaks, no longer than `most`; empty if it has none."""
    return " ".join(str(error).split())[:most]


def model_failure(scene: str, model: str, error: BaseException, where: str = "") -> RunFailedError:
    """What ends a command where a model's own code fails, in one line; where : its trace is."""
    text = in_one_line(error) or "no message"
    return RunFailedError(f"scene {scene}, model {model}: {type(error).__name__}: {text}{where}")


def file_reason(error: OSError) -> str:
    """What the system refused, after the file's name where it has one."""
    where = f"{error.filename}: " if error.filename else ""
    return where + reason(error)
