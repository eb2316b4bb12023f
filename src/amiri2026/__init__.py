"""The paper, claim by claim: a client of `continuair`.

Amiri, Sepahvand, Mantegh, Janabi-Sharifi: "Systematic Analysis of Coupling Effects on Closed-Loop
and Open-Loop Performance in Aerial Continuum Manipulators", arXiv 2602.18684. Its open-loop tests,
its tracking task, its sweeps of parameters and its table, its sentences and what judges them. Only
public names of `continuair` are used here, and nothing of `continuair` imports this package.
"""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from amiri2026.open_loop_tests import OPEN_LOOP_TESTS as OPEN_LOOP_TESTS
    from amiri2026.open_loop_tests import open_loop_test as open_loop_test

__getattr__, __dir__, __all__ = lazy.names(
    __name__, {"open_loop_tests": ("OPEN_LOOP_TESTS", "open_loop_test")}
)
