"""The published method (PARC, NeuralPARC): baseline of benchmarks, method="paper", pictures."""
