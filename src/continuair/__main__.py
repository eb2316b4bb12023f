"""The `continuair` command from its first moment: Ctrl-C is one word while it loads, too."""

# The module signal wraps this one, and loads for as long as all that is here together: until the
# handler is set, Ctrl-C is Python's own.
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
            app(prog_name="continuair")  # also by python -m, so that its completion is that one's
        finally:
            sys.stdout.flush()
    except _OutputError as error:
        problem = f"standard output cannot be written ({os.strerror(error.errno or 0)})"
        _end(f"{problem}; point it to another place.", _UNUSABLE)


class _OutputError(OSError):
    """Standard output takes no more."""


class _Output(io.TextIOWrapper):
    """Standard output whose errors can be told from those of other files."""

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
    """Let the streams take all characters; end if there is nowhere to print results to."""
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115
    if sys.stdout is None:
        _end("standard output is closed; point it to a file, or to /dev/null.", _UNUSABLE)
    out, told = sys.stdout, sys.stderr
    assert isinstance(out, io.TextIOWrapper) and isinstance(told, io.TextIOWrapper)
    told.reconfigure(errors="replace")
    encoding, by_lines = out.encoding, out.line_buffering
    sys.stdout = _Output(out.detach(), encoding, "replace", line_buffering=by_lines)


def _leave(*_: object) -> None:
    # An exception could surface anywhere in an import, and be taken for that import's failure.
    _end("Interrupted.", _INTERRUPTED)


def _end(sentence: str, code: int) -> None:
    sys.stderr.write(f"{sentence}\n")
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
