"""Figures: each reads datasets and results, and simulates nothing."""
