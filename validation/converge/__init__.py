"""``fingertap converge``: the reference refined, one parameter at a time."""
