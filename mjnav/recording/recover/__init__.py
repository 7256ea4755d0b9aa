"""What is intact in a damaged log, as a whole log."""
