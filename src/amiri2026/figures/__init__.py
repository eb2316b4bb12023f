"""Figures of the paper's studies: each reads results and datasets, and simulates nothing."""
