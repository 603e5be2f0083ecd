from collections.abc import Iterator

import pytest
from matplotlib import pyplot as plt


@pytest.fixture
def figures_kept(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Figures stay open when they are saved."""
    with monkeypatch.context() as patch:
        patch.setattr(plt, "close", lambda figure: None)
        yield
    plt.close("all")
