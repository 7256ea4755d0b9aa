"""Running a study's episodes, here, in worker processes or on a Dask cluster."""
