"""Which vehicle explains the open-loop table of Amiri et al.: a search, and its negative result."""
