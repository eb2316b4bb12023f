"""The commands of this package, and those that others add."""

# The order in which --help lists the commands.
from continuair.cli import (  # noqa: F401, I001
    advise,
    atlas,
    sweep,
    identify,
    release,
    new,
    view,
    vehicles,
    export,
)
from continuair import extensions
from continuair.cli.application import app

extensions.add_commands(app)

__all__ = ["app"]
