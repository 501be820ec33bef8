"""From a black box to a model: runs, a network, a bound of its error."""
