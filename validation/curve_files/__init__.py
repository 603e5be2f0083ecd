"""References from data: a file's curves, and notes of what was done to them.

A reader (`table.py`, `solver_output.py`) takes a file's text and the `Sidecar` beside it and gives
`Samples`; `tap.py` makes `Curves` of any of them.
"""
