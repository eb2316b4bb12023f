"""Bodies of a section: its uniform backbone and its disks."""

from __future__ import annotations

from continuair.typing import Array
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import Section


class Rod:
    """Bodies of a section over runs.

    length (runs,); backbone: (mass, transverse inertia, axial inertia); disks: (position, mass,
    transverse inertia, axial inertia) each.
    """

    def __init__(self, section: Section, runs: int) -> None:
        self.length: Array = per_run(section.length, runs)
        densities = (
            section.mass_per_length,
            section.transverse_inertia_per_length,
            section.axial_inertia_per_length,
        )
        self.backbone: list[Array] = [per_run(each, runs) * self.length for each in densities]
        self.disks: list[list[Array]] = [
            [
                per_run(value, runs)
                for value in (d.position, d.mass, d.transverse_inertia, d.axial_inertia)
            ]
            for d in section.disks
        ]
