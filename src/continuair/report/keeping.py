"""What is written of each study: its tables and its figures, in one folder."""

from __future__ import annotations

from typing import Any

from continuair.studies.results import ResultFolder
from continuair.vehicle.vehicle import Vehicle


def keep(name: str, found: Any, folder: ResultFolder) -> None:
    """Write the result of a study, by its name, to its folder: data, tables and figures."""
    _KEEPERS[name](found, folder)


def _open_loop(found: Any, folder: ResultFolder) -> None:
    from continuair.figures import open_loop as figures
    from continuair.studies.open_loop import report

    report.write(found, folder)
    figures.write(found.results, found.datasets, folder.file)


def _sensitivity(found: Any, folder: ResultFolder) -> None:
    from continuair.figures import sensitivity as figures
    from continuair.studies.sensitivity import report

    report.write(found, folder)
    figures.write(found.results, found.datasets, folder.file)


def _tracking(found: Any, folder: ResultFolder) -> None:
    from continuair.figures import tracking as figures
    from continuair.studies.tracking import report

    report.write(found, folder)
    camera = Vehicle(**found.results["vehicle"]).camera
    figures.write(found.results, found.datasets, camera, folder.file)


def _region(found: Any, folder: ResultFolder) -> None:
    from continuair.figures import region as figures
    from continuair.studies.region import report

    report.write(found, folder)
    figures.write(found.results, found.flights, folder.file)


def _robustness(found: Any, folder: ResultFolder) -> None:
    from continuair.figures import robustness as figures
    from continuair.studies.robustness import report

    report.write(found, folder)
    figures.write(found.results, folder.file)


def _table(found: Any, folder: ResultFolder) -> None:
    from continuair.figures import table as figures
    from continuair.studies.table import report

    report.write(found, folder)
    figures.write(found, folder.file)


def _cost(found: Any, folder: ResultFolder) -> None:
    from continuair.studies.cost import as_table

    folder.store(found, as_table(found))


_KEEPERS = {
    "open_loop": _open_loop,
    "sensitivity": _sensitivity,
    "sensitivity_hertz": _sensitivity,
    "tracking": _tracking,
    "region": _region,
    "robustness": _robustness,
    "table": _table,
    "cost": _cost,
}
