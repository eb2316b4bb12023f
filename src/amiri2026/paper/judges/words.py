"""Numerical meanings of the paper's words of degree, the same everywhere."""

SAME = 0.1
"""Numbers within this share of each other are the same, similar, on par."""

NEGLIGIBLE = 0.1
"""A share up to this is negligible, minimal, small."""

PRONOUNCED = 2.0
"""A factor from this on is pronounced, significant, strong."""
