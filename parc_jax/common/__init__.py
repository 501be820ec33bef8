"""What every folder stands on: arrays, keys, tolerances, exact numbers, premises, errors."""
