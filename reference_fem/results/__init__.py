"""What a run keeps and returns: the result, the first tap's scalars, and their forms."""
