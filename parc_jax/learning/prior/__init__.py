"""Few real runs: a twist or a simulator gives the shape; the claim is from the runs alone."""
