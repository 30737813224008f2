"""What sheets folded along curved creases are used for (Ch. 4 to 6 of the source)."""
