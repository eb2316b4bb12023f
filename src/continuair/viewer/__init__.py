"""Flights in a browser, as a page or as a video: geometry over time."""
