"""The `continuair` command from its first moment: Ctrl-C is one word while it loads, too."""

import os
import signal
import sys
from typing import Any

from continuair.errors import INTERRUPTED


def main() -> None:
    """Run the command line."""
    signal.signal(signal.SIGINT, _leave)
    from continuair.cli import app

    app()


def _leave(*_: Any) -> None:
    # An exception could surface anywhere in an import, and be taken for that import's failure.
    sys.stderr.write("Interrupted.\n")
    sys.stderr.flush()
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
