"""The command line: each command reads its input, calls the library and shows what came out."""

# The order in which --help lists the commands.
from continuair.cli import (  # noqa: F401, I001
    open_loop,
    sensitivity,
    tracking,
    region,
    robustness,
    cost,
    advise,
    atlas,
    sweep,
    identify,
    new,
    view,
    vehicles,
    export,
    paper,
)
from continuair.cli.application import app

__all__ = ["app"]
