"""What the paper's words of degree count as, and the steps that are flown, everywhere alike."""

SAME = 0.1
"""Numbers within this share of each other are the same, similar, on par."""

NEGLIGIBLE = 0.1
"""A share up to this is negligible, minimal, small."""

PRONOUNCED = 2.0
"""A factor from this on is pronounced, significant, strong."""

SHORTER = (1e-4, 2.5e-5, 6.25e-6, 1.5625e-6)
"""Steps [s] that are flown in turn until what is found does not hang on them."""
