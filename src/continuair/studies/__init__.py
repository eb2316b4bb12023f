"""Studies: parameters and calls; each returns results and datasets, and can store them."""
