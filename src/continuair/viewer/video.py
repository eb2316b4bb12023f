"""A flight as a video, drawn by matplotlib without a display."""

from __future__ import annotations

import os
import shutil
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.figure import Figure
from numpy.typing import NDArray

from continuair.errors import InputError
from continuair.figures import style
from continuair.files import new_file, printed, writing
from continuair.progress import Progress
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle
from continuair.viewer.drawing import Picture
from continuair.viewer.scene import Scene, scene

_RATE = {".mp4": 30.0, ".gif": 20.0}
"""Frames per second by the file's suffix; those of a GIF last whole hundredths of a second."""

_SIZE, _RESOLUTION = (6.4, 4.8), 150
"""Of a frame [inch, dots per inch]."""


def animate(
    flight: xr.Dataset,
    path: str | os.PathLike[str],
    vehicle: Vehicle | None = None,
    *,
    ghost: xr.Dataset | None = None,
    scenario: Scenario | None = None,
) -> None:
    """Write a video of a flight in real time.

    Parameters
    ----------
    flight : xarray.Dataset
        Result of one run of `simulate`.
    path : str or path-like
        Path of the new file, .mp4 (needs ffmpeg) or .gif.
    vehicle : Vehicle, optional
        The simulated vehicle. Default: that of the result's attributes.
    ghost : xarray.Dataset, optional
        Flight of another model over the same times, drawn beside it.
    scenario : Scenario, optional
        The simulated scenario. A result does not hold its functions of time.

    Raises
    ------
    InputError
        If the file exists or has another suffix, ffmpeg is missing, or a flight is unsuitable.
    """
    check_video(path)
    found = scene(flight, vehicle, ghost, scenario, rate=max(_RATE.values()))
    animation(found, path, found.vehicle.name)


def check_video(path: str | os.PathLike[str]) -> Path:
    """Return the path of a video that can be written; else raise InputError."""
    suffix = Path(path).suffix
    if suffix not in _RATE:
        raise InputError("video", f"is {printed(path)}", "name a file that ends in .mp4 or .gif")
    if suffix == ".mp4" and _ffmpeg() is None:
        raise InputError(
            "video",
            f"is {printed(path)}, which needs ffmpeg",
            "install ffmpeg, or pip install 'continuair[video]', or name a .gif",
        )
    return new_file("video", path)


def animation(
    shown: Scene, path: str | os.PathLike[str], label: str, progress: Progress | None = None
) -> None:
    """Write a scene as a video with a label; raises InputError."""
    file = check_video(path)
    rate = _RATE[file.suffix]
    chosen = _frames(shown, rate)
    with style.applied(), matplotlib.rc_context({"animation.ffmpeg_path": _ffmpeg() or "ffmpeg"}):
        figure = Figure(figsize=_SIZE, dpi=_RESOLUTION)
        picture = Picture(figure, shown, label)
        writer: AbstractMovieWriter = PillowWriter(fps=int(rate))
        if file.suffix == ".mp4":
            told = ["-pix_fmt", "yuv420p", "-crf", "20", "-movflags", "+faststart"]
            writer = FFMpegWriter(fps=int(rate), codec="libx264", extra_args=told)
        with writing("video", path), _encoding(path):
            _write(writer, figure, file, chosen, picture.show, progress)


@contextmanager
def _encoding(path: str | os.PathLike[str]) -> Iterator[None]:
    """Raise InputError if ffmpeg fails inside the block."""
    try:
        yield
    except (CalledProcessError, BrokenPipeError):
        raise InputError(
            "video",
            f"is {printed(path)}, which ffmpeg failed to write",
            "see whether the disk is full and ffmpeg has libx264, or name a .gif",
        ) from None


def _write(
    writer: Any,
    figure: Figure,
    file: Path,
    chosen: NDArray[np.int64],
    show: Callable[[int], None],
    progress: Progress | None,
) -> None:
    """Write to a temporary file and rename it, so that an interruption leaves nothing behind."""
    draft = file.with_name(f"{file.stem}.{uuid.uuid4().hex}{file.suffix}")
    try:
        with writer.saving(figure, os.fspath(draft), _RESOLUTION):
            for index, frame in enumerate(chosen):
                if progress is not None:
                    progress(index + 1, len(chosen), "drawing")
                show(int(frame))
                writer.grab_frame()
        os.replace(draft, new_file("video", file))
    finally:
        draft.unlink(missing_ok=True)


def _frames(shown: Scene, rate: float) -> NDArray[np.int64]:
    """Return the frame of the flight for each frame of a video."""
    length = float(shown.times[-1] - shown.times[0])
    wanted = shown.times[0] + np.arange(int(np.floor(length * rate)) + 1) / rate
    return np.searchsorted(shown.times, wanted + 1e-9, side="right") - 1


def _ffmpeg() -> str | None:
    """Return the ffmpeg on the PATH, or that of imageio-ffmpeg."""
    found = shutil.which("ffmpeg")
    if found is None:
        try:
            from imageio_ffmpeg import get_ffmpeg_exe

            found = str(get_ffmpeg_exe())
        except (ImportError, RuntimeError):
            return None
    return found
