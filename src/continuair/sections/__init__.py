"""Sections of arms, a file or package for each kind, on one list by name."""

from continuair.sections.arc import Arc
from continuair.sections.kind import SectionCode, SectionKind
from continuair.vehicle.section import Section

KINDS: dict[str, type[SectionKind]] = {kind.name: kind for kind in (Arc,)}


def kind_of(section: Section) -> SectionKind:
    """Return the kind of a section.

    Parameters
    ----------
    section : Section
        A section of a vehicle or of a batch.

    Returns
    -------
    SectionKind
        The kind that its `kind` names.
    """
    return KINDS[section.kind].of(section)


def arcs(*sections: int) -> tuple[tuple[SectionKind, ...], ...]:
    """Return the kinds of arms of so many arcs each, as a `Tree` holds them."""
    return tuple((Arc(),) * count for count in sections)


__all__ = ["KINDS", "Arc", "SectionCode", "SectionKind", "arcs", "kind_of"]
