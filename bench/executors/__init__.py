"""Where trials run: in this process, on its cores, on a Dask cluster or on a Ray cluster."""
