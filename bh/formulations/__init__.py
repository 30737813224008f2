"""What a formulation is, which ones there are, and the states that are read from their unknowns."""
