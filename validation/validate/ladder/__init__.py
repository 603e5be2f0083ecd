"""The ladder of comparisons: structure (rung 2), contact (3), the paper's own set-up (4)."""
