"""What a user describes: sheet, supports, creases, actuations, steps. Frozen data without unknowns."""
