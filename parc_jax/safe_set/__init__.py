"""Which plans are safe: one plan's verdict, corridors that hold them all, many scenes at once."""
