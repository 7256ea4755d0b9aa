"""Studies: many runs, and what they say about a method."""
