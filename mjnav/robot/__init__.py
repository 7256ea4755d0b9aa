"""What is on board of the robot: its estimators, its map, the commands under way and their latency."""
