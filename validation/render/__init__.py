"""``fingertap render``: pictures of a solid run, drawn off-screen."""
