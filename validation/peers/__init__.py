"""Other programs on the same problems: Exudyn, SciPy, CalculiX, Akantu, Kratos, PyElastica."""
