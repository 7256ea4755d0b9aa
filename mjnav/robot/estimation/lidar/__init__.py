"""Estimators that go by the lidar's scans."""
