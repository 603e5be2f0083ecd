import pytest

from tests.validation.commands import Capture, Ended, Run, call


@pytest.fixture
def fingertap(capsys: Capture) -> Run:
    """Runs a command in the test's own process."""

    def run(*arguments: object) -> Ended:
        code = call(*arguments)
        return Ended(code, *capsys.readouterr())

    return run
