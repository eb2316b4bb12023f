"""Initialisation of Warp and compilation of kernels, with checks of the kernel cache.

Neither the initialisation of Warp nor its compiler is thread-safe, so that both share one lock.
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
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial, wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import warp as wp

from continuair.device.options import check_cpu_target
from continuair.engine.builds import noticed, run_together, stderr_behind
from continuair.errors import ContinuairWarning, InputError
from continuair.files import printed, reason

Parameters = ParamSpec("Parameters")
Made = TypeVar("Made")

_lock = threading.RLock()
_started: list[bool] = []
_loaded: set[tuple[Any, str]] = set()
_temporary: list[Path] = []

_STDERR = 2
# Output of Warp and Clang that no log level suppresses: reported otherwise, or irrelevant.
_NOT_SAID = (
    b"Could not find or load the NVIDIA CUDA driver",
    b"error: unknown target CPU",
    b"note: valid target CPU values are",
    b"PCH generation failed",
)
# Size of a compiled kernel, with a margin [bytes].
_BYTES_TO_TRY = 1_000_000
_SUM = ".sum"
# A CPU has blocks of one thread. On an H100 small blocks simulate 10,000 runs 1.3 to 1.4 times as
# fast as Warp's default of 256, and a million runs 1.04 times as fast (benchmarks/gpu.py).
_BLOCK = {"cpu": 1, "cuda": 64}


def made_once(make: Callable[Parameters, Made]) -> Callable[Parameters, Made]:
    """Cache the results of a function, and compute each only once across threads.

    Parameters
    ----------
    make : callable
        Function with hashable arguments.

    Returns
    -------
    callable
        The function with a cache, as by `functools.cache`, and a lock.
    """
    kept: Any = cache(make)
    return wraps(make)(made_alone(kept))


def made_alone(make: Callable[Parameters, Made]) -> Callable[Parameters, Made]:
    """Let one thread at a time call a function that uses Warp, without a cache."""

    @wraps(make)
    def found(*args: Parameters.args, **named: Parameters.kwargs) -> Made:
        with _lock:
            return make(*args, **named)

    return found


def start_warp() -> None:
    """Initialise Warp without its banner and its warning about a missing CUDA driver.

    Raises
    ------
    InputError
        If CONTINUAIR_CPU_TARGET is not a processor, or other users can write to the kernel cache.
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
    """Compile a kernel for a device, or load it from the cache, unless it is loaded already.

    Damaged files of the cache are compiled again. If the cache is not writeable, a temporary one
    replaces it, with a warning.

    Parameters
    ----------
    kernel : wp.Kernel
        The kernel.
    device : str
        Device of Warp, such as ``"cpu"`` or ``"cuda:0"``.

    Raises
    ------
    InputError
        If neither the cache nor a temporary folder is writeable.
    """
    module = kernel.module
    if (module, device) in _loaded:
        return
    with _lock:
        if (module, device) not in _loaded:
            _load(module, device, block_of(device))
            _loaded.add((module, device))


def load_together(kernels: Iterable[wp.Kernel | None], device: str) -> None:
    """Compile the kernels that are not in the cache, several at a time; `load` finds them there.

    None stands for a kernel that cannot be made, which whoever needs it finds out.
    """
    if device != "cpu" or wp.is_cuda_available():
        return
    block = block_of(device)
    modules = {id(kernel.module): kernel.module for kernel in kernels if kernel is not None}
    missing = [
        module
        for module in modules.values()
        if (module, device) not in _loaded and not any(_folder(module, block).glob("*.o"))
    ]
    if len(missing) > 1 and _problem(_cache()) is None:
        with _lock, _without_native_words():
            run_together([partial(_build, module, device, block) for module in missing])


def _build(module: Any, device: str, block: int) -> None:
    """Compile a module into the cache; whoever loads it reports what is wrong with it."""
    with suppress(Exception), noticed(module.name, _cache()):
        module.load(device, block)
        _keep_sums(_folder(module, block))


def kind_of(device: str) -> str:
    """Return the kind of a device: cpu or cuda."""
    return device.split(":")[0]


def block_of(device: str) -> int:
    """Return the threads per block of launches on a device, for which kernels are compiled."""
    return _BLOCK[kind_of(device)]


def compiles(kernel: wp.Kernel) -> bool:
    """Load a kernel for the CPU; return False, without output, if it does not compile."""
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
        with noticed(module.name, _cache()):
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
    """Return whether a module can be compiled again after its cached files are removed."""
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
    """Raise InputError if other users can write to the cache, whose kernels run unchecked."""
    try:
        found = folder.stat()
    except OSError:
        return
    others = found.st_uid not in (os.getuid(), 0)
    # A folder with the sticky bit is safe: other users cannot replace its files.
    if others or (found.st_mode & stat.S_IWOTH and not found.st_mode & stat.S_ISVTX):
        why = "belongs to another user" if others else "is writable by every user"
        raise InputError(
            "WARP_CACHE_PATH",
            f"is {printed(folder)}, which {why}, who could put code there",
            "name a folder of your own",
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
    # A property of this machine, which studies do not suppress.
    warnings.warn(
        f"the kernel cache {printed(where)} cannot be used ({problem}): kernels are compiled into "
        "a temporary folder; set WARP_CACHE_PATH to a writeable folder.",
        ContinuairWarning,
        stacklevel=2,
    )


def _no_cache(problem: str) -> InputError:
    return InputError(
        "WARP_CACHE_PATH",
        (
            f"is {printed(os.environ.get('WARP_CACHE_PATH', ''))!r}, where kernels cannot "
            f"be kept, nor in a temporary folder ({problem})"
        ),
        "free space, or name a writeable folder",
    )


def _cache() -> Path:
    return Path(str(wp.config.kernel_cache_dir))


def _problem(folder: Path) -> str | None:
    """Return why a kernel cannot be written to a cache, or None."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as stream:
            stream.write(bytes(_BYTES_TO_TRY))
            stream.flush()
    except OSError as error:
        return reason(error)
    return None


def _folder(module: Any, block: int) -> Path:
    """Return the folder of a module in the cache."""
    return _cache() / str(module.get_module_identifier(block))


def _damaged(folder: Path) -> list[Path]:
    """Return the files of a module that differ from what was compiled."""
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
        # No checksum was written: check whether the file is truncated.
        return path.suffix != ".o" or _is_whole_object(content)


def _is_whole_object(content: bytes) -> bool:
    """Return whether an ELF object file contains its whole table of sections."""
    if not content.startswith(b"\x7fELF\x02\x01"):
        return len(content) > 0
    if len(content) < 64:
        return False
    (table,) = struct.unpack_from("<Q", content, 0x28)
    size, count = struct.unpack_from("<HH", content, 0x3A)
    return bool(len(content) >= table + size * count)


def _keep_sums(folder: Path) -> None:
    """Write the checksum of every file of a module beside it, if possible."""
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
    """Remove files of a cache and their checksums; return whether there were any."""
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
    """Remove some lines of native libraries from stderr, such as that of a missing driver.

    Other output, of any thread, is passed on. what_fails: whether all output before an exception is
    removed, too.
    """
    failed = False
    _open_stderr()
    kept = os.dup(_STDERR)
    said = _file_without_disk()
    os.dup2(said, _STDERR)
    try:
        with stderr_behind(kept):
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
    """Return the descriptor of an unnamed file, in memory if the system supports that."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("stderr")
    number, name = tempfile.mkstemp()
    os.unlink(name)
    return number


def _open_stderr() -> None:
    """Open a null device as stderr in a process that was started without stderr (2>&-).

    Otherwise the next opened file would become stderr.
    """
    try:
        os.fstat(_STDERR)
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        if nowhere != _STDERR:
            os.dup2(nowhere, _STDERR)
            os.close(nowhere)
