"""What a run keeps and returns: rows of the history, postures, the result and its forms."""
