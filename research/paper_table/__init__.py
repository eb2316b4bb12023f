"""Search for vehicles and readings that give Table I of Amiri et al."""
