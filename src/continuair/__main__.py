"""Entry point of the `continuair` command, which handles Ctrl-C while it loads, too."""

# The module signal wraps this one, and takes as long to load as the rest of this file. Until the
# handler is set, Python handles Ctrl-C.
import _signal  # type: ignore[import-not-found]
import io
import os
import sys

_INTERRUPTED, _UNUSABLE = 130, 2


def main() -> None:
    """Run the command line."""
    _signal.signal(_signal.SIGINT, _leave)
    _prepare_streams()
    from continuair.cli.commands import app

    try:
        try:
            app(prog_name="continuair")  # also with python -m, for the same shell completion
        finally:
            sys.stdout.flush()
    except _OutputError as error:
        problem = f"standard output cannot be written ({os.strerror(error.errno or 0)})"
        _end(f"{problem}; redirect it elsewhere.", _UNUSABLE)


class _OutputError(OSError):
    """Standard output cannot be written."""


class _Output(io.TextIOWrapper):
    """Standard output whose errors are distinct from those of other files."""

    def write(self, text: str) -> int:
        try:
            return super().write(text)
        except OSError as error:
            raise _OutputError(*error.args) from None

    def flush(self) -> None:
        try:
            super().flush()
        except OSError as error:
            raise _OutputError(*error.args) from None


def _prepare_streams() -> None:
    """Replace characters that streams cannot encode; exit if there is no standard output."""
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115
    if sys.stdout is None:
        _end("standard output is closed; redirect it to a file, or to /dev/null.", _UNUSABLE)
    out, told = sys.stdout, sys.stderr
    assert isinstance(out, io.TextIOWrapper) and isinstance(told, io.TextIOWrapper)
    told.reconfigure(errors="replace")
    encoding, by_lines = out.encoding, out.line_buffering
    sys.stdout = _Output(out.detach(), encoding, "replace", line_buffering=by_lines)


def _leave(*_: object) -> None:
    # An exception inside an import could be handled there as a failed import.
    _end("Interrupted.", _INTERRUPTED)


def _end(sentence: str, code: int) -> None:
    sys.stderr.write(f"{sentence}\n")
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
