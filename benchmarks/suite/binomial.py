"""Exact statements about counts of independent trials, from logarithms alone."""

import math

import numpy as np


def tail(n: int, x: int, p: float) -> float:
    """P(X >= x) of X binomial (n, p)."""
    if x <= 0:
        return 1.0
    if p <= 0 or x > n:
        return 0.0
    if p >= 1:
        return 1.0
    i = np.arange(x, n + 1)
    logs = np.array([math.lgamma(j + 1) + math.lgamma(n - j + 1) for j in i])
    logs = math.lgamma(n + 1) - logs + i * math.log(p) + (n - i) * math.log1p(-p)
    return float(min(1.0, np.exp(logs).sum()))


def interval(n: int, x: int, confidence: float = 0.95) -> tuple[float, float]:
    """Clopper and Pearson's interval of a probability, of n trials of which x succeeded."""
    each = 0.5 * (1 - confidence)
    low = 0.0 if x == 0 else _solve(lambda p: tail(n, x, p), each)
    high = 1.0 if x == n else _solve(lambda p: 1 - tail(n, x + 1, p), each, falls=True)
    return low, high


def _solve(f, level: float, falls: bool = False) -> float:
    """The p at which a monotone f is `level`."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (f(middle) < level) != falls else (low, middle)
    return 0.5 * (low + high)
