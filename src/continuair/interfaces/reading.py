"""Results read back from netCDF files."""

from __future__ import annotations

import json
import os
from importlib.metadata import version

import xarray as xr

from continuair.errors import InputError
from continuair.files import check_regular, printed, reason, user_path


def read_result(path: str | os.PathLike[str]) -> xr.Dataset:
    """A result that `to_netcdf` or a study wrote, all of it in memory.

    Raises InputError for what is not there, no netCDF, damaged, not ours, or of a later version.
    """
    file = user_path("result", path)
    check_regular("result", file)
    try:
        with xr.open_dataset(file, engine="h5netcdf") as found:
            dataset = found.load()
    except FileNotFoundError:
        raise InputError(f"{printed(path)}: no such file; correct the path.") from None
    except IsADirectoryError:
        raise InputError(f"{printed(path)}: is a folder; give a .nc file in it.") from None
    except (OSError, ValueError, RuntimeError, KeyError) as error:
        why = reason(error) if isinstance(error, (OSError, ValueError)) else str(error)
        raise InputError(
            f"{printed(path)}: no netCDF file, or a damaged one ({why}); write the result again."
        ) from None
    if not {"vehicle", "versions"} <= dataset.attrs.keys():
        raise InputError(
            f"{printed(path)}: has no vehicle among its attributes, so that continuair has not "
            "written it; give a result of simulate, or of a study."
        )
    written = str(json.loads(dataset.attrs["versions"]).get("continuair", "0"))
    if _numbers(written) > _numbers(version("continuair")):
        raise InputError(
            f"{printed(path)}: is of continuair {written}, later than this "
            f"{version('continuair')}; install that version."
        )
    return dataset


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(".") if part.isdecimal())
