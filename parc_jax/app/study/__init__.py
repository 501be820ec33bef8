"""A study: from runs to models, their safe set, its proof, its replay, a report and pictures."""
