"""Standard output, progress, signals, and the process that watches a command."""
