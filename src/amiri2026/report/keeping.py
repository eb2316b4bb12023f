"""Files of each study: its tables and its figures, in one folder."""

from __future__ import annotations

from typing import Any

from continuair.studies import ResultFolder
from continuair.vehicle import vehicle_of_run


def keep(name: str, found: Any, folder: ResultFolder) -> None:
    """Write the result of a study, by its name, to its folder: data, tables and figures."""
    _KEEPERS[name](found, folder)


def _open_loop(found: Any, folder: ResultFolder) -> None:
    from amiri2026.figures import open_loop as figures
    from amiri2026.open_loop import report

    report.write(found, folder)
    figures.write(found.results, found.datasets, folder.file)


def _sensitivity(found: Any, folder: ResultFolder) -> None:
    from amiri2026.figures import sensitivity as figures
    from amiri2026.sensitivity import report

    report.write(found, folder)
    figures.write(found.results, found.datasets, folder.file)


def _tracking(found: Any, folder: ResultFolder) -> None:
    from amiri2026.figures import tracking as figures
    from amiri2026.tracking import report

    report.write(found, folder)
    camera = vehicle_of_run(found.results["vehicle"], None).camera
    figures.write(found.results, found.datasets, camera, folder.file)


def _region(found: Any, folder: ResultFolder) -> None:
    from amiri2026.figures import region as figures
    from amiri2026.region import report

    report.write(found, folder)
    figures.write(found.results, found.flights, folder.file)


def _robustness(found: Any, folder: ResultFolder) -> None:
    from amiri2026.figures import robustness as figures
    from amiri2026.robustness import report

    report.write(found, folder)
    figures.write(found.results, folder.file)


def _table(found: Any, folder: ResultFolder) -> None:
    from amiri2026.figures import table as figures
    from amiri2026.table import report

    report.write(found, folder)
    figures.write(found, folder.file)


def _cost(found: Any, folder: ResultFolder) -> None:
    from amiri2026.cost import as_table

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
