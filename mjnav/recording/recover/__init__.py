"""What is intact in a damaged log."""
