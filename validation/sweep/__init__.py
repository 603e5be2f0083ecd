"""Many scenes through models: points, runs on many cores or machines, one dataset, one page."""
