"""Linear programs whose answers are checked, and what checks them."""
