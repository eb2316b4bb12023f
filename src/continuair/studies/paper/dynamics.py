"""Judges."""

JUDGES = {}
