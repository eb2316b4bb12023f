"""Kinds of sections, one file or package each, in a table by name."""

from continuair.sections.arc import Arc
from continuair.sections.kind import SectionCode, SectionKind
from continuair.sections.strain import StrainField
from continuair.vehicle.section import Section

KINDS: dict[str, type[SectionKind]] = {kind.name: kind for kind in (Arc, StrainField)}


def kind_of(section: Section) -> SectionKind:
    """Return the kind of a section.

    Parameters
    ----------
    section : Section
        A section of a vehicle or of a batch.

    Returns
    -------
    SectionKind
        The kind named by its attribute `kind`.
    """
    return KINDS[section.kind].of(section)


def arcs(*sections: int) -> tuple[tuple[SectionKind, ...], ...]:
    """Return the kinds of the sections of arms that consist of arcs.

    Parameters
    ----------
    *sections : int
        Number of arcs of each arm.

    Returns
    -------
    tuple of tuple of SectionKind
        Kinds of each arm, as in `Tree.kinds`.
    """
    return tuple((Arc(),) * count for count in sections)


__all__ = ["KINDS", "Arc", "SectionCode", "SectionKind", "StrainField", "arcs", "kind_of"]
