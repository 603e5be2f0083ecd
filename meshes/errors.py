"""The one exception that this package raises for wrong input."""


class MeshError(ValueError):
    """A mesh cannot be built, written or read; the message is one line meant for users."""
