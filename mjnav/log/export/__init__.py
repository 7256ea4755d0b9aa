"""A log for other programs: CSV or Parquet tables, a ROS 2 bag."""
