"""``fingertap validate``: all models on the scenes, tables, figures, one page."""
