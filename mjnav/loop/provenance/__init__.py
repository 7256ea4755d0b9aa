"""Which program, sources, libraries and processor a run's bits come from."""
