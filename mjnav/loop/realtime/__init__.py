"""The real-time rate test: scheduling, load, and what the machine itself did meanwhile."""
