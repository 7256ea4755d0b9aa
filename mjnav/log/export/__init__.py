"""A log for other programs: TUM trajectories, CSV tables, a ROS 2 bag."""
