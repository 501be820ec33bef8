"""What was found, spelled exactly for a checker, and the checker asked."""
