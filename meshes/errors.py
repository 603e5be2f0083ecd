"""The package's one exception."""


class MeshError(ValueError):
    """A mesh cannot be built, written or read; the message is one line meant for users."""
