"""Starting Warp and loading kernels: one thread at a time, from a cache that may be damaged.

Neither Warp's start nor its compiler is thread-safe, so that all of them share one lock here.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import stat
import struct
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import warp as wp

from continuair.device.options import check_cpu_target
from continuair.errors import ContinuairWarning, InputError
from continuair.files import printed, reason

Parameters = ParamSpec("Parameters")
Made = TypeVar("Made")

_lock = threading.RLock()
_started: list[bool] = []
_loaded: set[tuple[Any, str]] = set()
_temporary: list[Path] = []

_STDERR = 2
# What Warp and Clang say past any log level, and what is told otherwise or needs no word.
_NOT_SAID = (
    b"Could not find or load the NVIDIA CUDA driver",
    b"error: unknown target CPU",
    b"note: valid target CPU values are",
    b"PCH generation failed",
)
# What a compiled kernel takes, with some room.
_BYTES_TO_TRY = 1_000_000
_SUM = ".sum"
# A CPU has blocks of one thread; on an H100 small ones fly 10,000 runs 1.3 to 1.4 times as fast as
# Warp's 256, and a million 1.04 times (benchmarks/gpu.py).
_BLOCK = {"cpu": 1, "cuda": 64}


def made_once(make: Callable[Parameters, Made]) -> Callable[Parameters, Made]:
    """Keep what a function makes for its arguments, as `cache` does, and never make it twice."""
    kept: Any = cache(make)
    return wraps(make)(made_alone(kept))


def made_alone(make: Callable[Parameters, Made]) -> Callable[Parameters, Made]:
    """Let one thread at a time make something of Warp's, anew each time."""

    @wraps(make)
    def found(*args: Parameters.args, **named: Parameters.kwargs) -> Made:
        with _lock:
            return make(*args, **named)

    return found


def start_warp() -> None:
    """Initialise Warp without its banner, and without its warning that there is no CUDA driver.

    Raises InputError if CONTINUAIR_CPU_TARGET names no processor.
    """
    if _started:
        return
    with _lock:
        if not _started:
            wp.config.log_level = wp.LOG_ERROR
            with _without_native_words():
                _initialise()
                check_cpu_target(lambda kernel: load(kernel, "cpu"))
            _started.append(True)


def load(kernel: wp.Kernel, device: str) -> None:
    """Compile a kernel for a device, or load it from the cache, unless that is done.

    What is damaged in the cache is built anew; a cache that cannot be written to is replaced by a
    temporary one, with a warning.
    """
    module = kernel.module
    if (module, device) in _loaded:
        return
    with _lock:
        if (module, device) not in _loaded:
            _load(module, device, block_of(device))
            _loaded.add((module, device))


def block_of(device: str) -> int:
    """Threads per block of every launch on a device, for which kernels are compiled."""
    return _BLOCK[device.split(":")[0]]


def compiles(kernel: wp.Kernel) -> bool:
    """Load a kernel for the CPU, as `load` does; False if the compiler refuses it, and no word."""
    with _lock:
        try:
            with _without_native_words(what_fails=True):
                load(kernel, "cpu")
        except InputError:
            raise
        except Exception:
            # Warp has no exception of its own for what it cannot build.
            return False
    return True


def _load(module: Any, device: str, block: int) -> None:
    if _remove(_damaged(_folder(module, block))):
        module.mark_modified()
    try:
        module.load(device, block)
    except Exception as error:
        # Warp has no exception of its own for what it cannot build or load.
        if not _built_anew(module, device, block):
            problem = _problem(_cache())
            if problem is None or _temporary:
                raise
            _use_temporary_cache(problem)
            module.mark_modified()
            try:
                module.load(device, block)
            except OSError as full:
                raise _no_cache(reason(full)) from error
    _keep_sums(_folder(module, block))


def _built_anew(module: Any, device: str, block: int) -> bool:
    """Whether a module that the cache held in some form can be built in its place."""
    folder = _folder(module, block)
    for left in folder.parent.glob(f"{folder.name}_p{os.getpid()}_t*"):
        shutil.rmtree(left, ignore_errors=True)
    if not _remove(folder.glob("*")):
        return False
    module.mark_modified()
    try:
        module.load(device, block)
    except Exception:
        return False
    return True


def _initialise() -> None:
    try:
        wp.init()
    except OSError as error:
        _use_temporary_cache(reason(error))
        wp.init()
    for folder in (_cache(), _cache().parent):
        _check_owner(folder)


def _check_owner(folder: Path) -> None:
    """Raise InputError for a cache that others can write: its kernels are run as they are."""
    try:
        found = folder.stat()
    except OSError:
        return
    others = found.st_uid not in (os.getuid(), 0)
    # What has the sticky bit is as good as one's own: others cannot put theirs in its place.
    if others or (found.st_mode & stat.S_IWOTH and not found.st_mode & stat.S_ISVTX):
        why = "belongs to another user" if others else "is writable by every user"
        raise InputError(
            f"the kernel cache {printed(folder)} {why}, so that others could put code there; set "
            "WARP_CACHE_PATH to a folder of your own."
        )


def _use_temporary_cache(problem: str) -> None:
    where = wp.config.kernel_cache_dir or os.environ.get("WARP_CACHE_PATH") or "in the home folder"
    try:
        folder = Path(tempfile.mkdtemp(prefix="continuair-kernels-"))
    except OSError as error:
        raise _no_cache(reason(error)) from None
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    _temporary.append(folder)
    wp.config.kernel_cache_dir = str(folder)
    # Of this machine: no study leaves it untold.
    warnings.warn(
        f"the kernel cache {printed(where)} cannot be used ({problem}): this run compiles its "
        "kernels into a temporary folder; set WARP_CACHE_PATH to a folder that you may write to.",
        ContinuairWarning,
        stacklevel=2,
    )


def _no_cache(problem: str) -> InputError:
    return InputError(
        f"WARP_CACHE_PATH is {printed(os.environ.get('WARP_CACHE_PATH', ''))!r}, where kernels "
        f"cannot be kept, nor in a temporary folder ({problem}); make room, or name a folder that "
        "you may write to."
    )


def _cache() -> Path:
    return Path(str(wp.config.kernel_cache_dir))


def _problem(folder: Path) -> str | None:
    """Why a kernel cannot be written to a cache, None if it can."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as stream:
            stream.write(bytes(_BYTES_TO_TRY))
            stream.flush()
    except OSError as error:
        return reason(error)
    return None


def _folder(module: Any, block: int) -> Path:
    """Where the cache holds a module."""
    return _cache() / str(module.get_module_identifier(block))


def _damaged(folder: Path) -> list[Path]:
    """Files of a module that are not what was built."""
    files = [path for path in folder.glob("*") if path.suffix != _SUM]
    return [path for path in files if not _is_whole(path)]


def _is_whole(path: Path) -> bool:
    try:
        content = path.read_bytes()
    except OSError:
        return False
    try:
        return _sum_file(path).read_bytes() == _sum(content)
    except OSError:
        # Whoever built it has not kept its sum: one that was cut shows by itself.
        return path.suffix != ".o" or _is_whole_object(content)


def _is_whole_object(content: bytes) -> bool:
    """Whether an object file of ELF reaches to the end of its table of sections, as it must."""
    if not content.startswith(b"\x7fELF\x02\x01"):
        return len(content) > 0
    if len(content) < 64:
        return False
    (table,) = struct.unpack_from("<Q", content, 0x28)
    size, count = struct.unpack_from("<HH", content, 0x3A)
    return bool(len(content) >= table + size * count)


def _keep_sums(folder: Path) -> None:
    """Write the sum of every file of a module beside it, where that can be done."""
    for path in folder.glob("*"):
        if path.suffix != _SUM and not _sum_file(path).exists():
            try:
                new = path.with_name(f"{path.name}.{os.getpid()}{_SUM}")
                new.write_bytes(_sum(path.read_bytes()))
                os.replace(new, _sum_file(path))
            except OSError:
                return


def _sum_file(path: Path) -> Path:
    return path.with_name(path.name + _SUM)


def _sum(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=16).hexdigest().encode()


def _remove(paths: Iterator[Path] | list[Path]) -> bool:
    """Remove files of a cache and their sums; return whether there were any."""
    found = list(paths)
    for path in [*found, *map(_sum_file, found)]:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with suppress(OSError):
                path.unlink(missing_ok=True)
    return bool(found)


@contextmanager
def _without_native_words(what_fails: bool = False) -> Iterator[None]:
    """Leave some lines of the native libraries out of stderr, such as that there is no driver.

    Whatever else is said meanwhile, by any thread, is passed on; what_fails: but for all that is
    said before an exception.
    """
    failed = False
    _open_stderr()
    kept = os.dup(_STDERR)
    said = _file_without_disk()
    os.dup2(said, _STDERR)
    try:
        yield
    except BaseException:
        failed = True
        raise
    finally:
        os.dup2(kept, _STDERR)
        os.close(kept)
        with open(said, "rb") as stream:
            stream.seek(0)
            rest = [line for line in stream if not any(words in line for words in _NOT_SAID)]
        if rest and not (failed and what_fails):
            os.write(_STDERR, b"".join(rest))


def _file_without_disk() -> int:
    """A descriptor of a file that has no name, in memory where the system has that."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("stderr")
    number, name = tempfile.mkstemp()
    os.unlink(name)
    return number


def _open_stderr() -> None:
    """Give a process that was started without stderr (2>&-) one that goes nowhere.

    The next file that is opened would be stderr otherwise, and be written to.
    """
    try:
        os.fstat(_STDERR)
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        if nowhere != _STDERR:
            os.dup2(nowhere, _STDERR)
            os.close(nowhere)
