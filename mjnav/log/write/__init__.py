"""The log while it is written."""
