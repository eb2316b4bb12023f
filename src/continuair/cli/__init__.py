"""The command line: each command reads its input, calls the library and prints the result."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.cli.commands import app as app
    from continuair.cli.completion import complete_gains as complete_gains
    from continuair.cli.options import JsonOption as JsonOption
    from continuair.cli.options import OutOption as OutOption
    from continuair.cli.options import VehicleOption as VehicleOption
    from continuair.cli.options import again as again
    from continuair.cli.options import check_json as check_json
    from continuair.cli.options import results_in as results_in
    from continuair.cli.options import tell_where as tell_where
    from continuair.cli.options import write_json as write_json
    from continuair.cli.terminal import print_markdown as print_markdown
    from continuair.cli.terminal import print_table as print_table
    from continuair.cli.terminal import progress_bar as progress_bar

__getattr__, __dir__, __all__ = lazy.names(
    __name__,
    {
        "commands": ("app",),
        "completion": ("complete_gains",),
        "options": (
            "JsonOption",
            "OutOption",
            "VehicleOption",
            "again",
            "check_json",
            "results_in",
            "tell_where",
            "write_json",
        ),
        "terminal": (
            "print_markdown",
            "print_table",
            "progress_bar",
        ),
    },
)
