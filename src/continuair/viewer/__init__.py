"""A flight to look at: geometry over time, in a browser, as a page or as a video."""
