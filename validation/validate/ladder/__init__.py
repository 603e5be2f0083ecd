"""The ladder of comparisons (design.md section 7): structure, contact, the paper's own set-up."""
