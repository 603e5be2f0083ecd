"""A cold run says what it compiles; a warm one is silent."""

from numba import njit

from validation.runs.execute import compiling_reported


def test_a_kernel_is_named_when_it_is_compiled_and_not_again() -> None:
    said: list[str] = []

    @njit
    def inner(x: float) -> float:
        return 2.0 * x

    @njit
    def outer(x: float) -> float:
        return inner(x) + 1.0

    with compiling_reported(lambda fraction, text: said.append(text)):
        assert outer(1.0) == 3.0
    assert [text.rsplit(".", 1)[-1] for text in said[:2]] == ["outer", "inner"]
    assert all(text.startswith(f"first run: compiling {__name__}.") for text in said[:2])
    assert "compiled" in said[-1]
    before = len(said)
    with compiling_reported(lambda fraction, text: said.append(text)):
        assert outer(2.0) == 5.0
    assert len(said) == before


def test_nobody_to_tell() -> None:
    with compiling_reported(None):
        assert njit(lambda x: x + 1.0)(1.0) == 2.0
