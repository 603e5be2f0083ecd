from collections.abc import Iterator

import pytest
from matplotlib import pyplot as plt

from tests.validation.commands import Capture, Ended, Run, call


@pytest.fixture
def fingertap(capsys: Capture) -> Run:
    """Runs a command in the test's own process."""

    def run(*arguments: object) -> Ended:
        code = call(*arguments)
        return Ended(code, *capsys.readouterr())

    return run


@pytest.fixture
def figures_kept(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Figures stay open when they are saved."""
    with monkeypatch.context() as patch:
        patch.setattr(plt, "close", lambda figure: None)
        yield
    plt.close("all")
