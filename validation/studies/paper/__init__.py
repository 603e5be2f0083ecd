"""The paper regenerated: every number that it prints, computed here, compared and judged."""
