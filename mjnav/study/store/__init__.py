"""The results of a sweep on disk: rows in Parquet files."""
