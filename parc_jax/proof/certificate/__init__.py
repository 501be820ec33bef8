"""Results as exact text for a checker, and its verdict on them."""
