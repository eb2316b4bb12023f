"""The paper's claims, tested one by one with `continuair`.

Amiri, Sepahvand, Mantegh, Janabi-Sharifi: "Systematic Analysis of Coupling Effects on Closed-Loop
and Open-Loop Performance in Aerial Continuum Manipulators", arXiv 2602.18684. The package holds its
open-loop tests, its tracking task, its parameter sweeps and its table, its sentences, and the
functions that judge them. It uses only public names of `continuair`, which does not import it.
"""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from amiri2026.open_loop_tests import OPEN_LOOP_TESTS as OPEN_LOOP_TESTS
    from amiri2026.open_loop_tests import open_loop_test as open_loop_test

__getattr__, __dir__, __all__ = lazy.names(
    __name__, {"open_loop_tests": ("OPEN_LOOP_TESTS", "open_loop_test")}
)
