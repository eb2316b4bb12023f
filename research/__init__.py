"""Finished studies that only the paper behind this project needed, outside the package."""
