"""Calls a peer's method, cold and warm, and spells the result. Imported by the peers' scripts:
NumPy only.
"""

import time

import numpy as np

LONG = 5.0  # [s] a first call beyond this is repeated once only


def record(number: int, name: str, call, repeats: int) -> dict:
    """Bounds lower, upper (b, n_out) of `call()` and its times [s], under keys that end in
    `number`.
    """
    begin = time.perf_counter()
    lower, upper = call()
    cold, warm = time.perf_counter() - begin, []
    for _ in range(repeats if cold < LONG else 1):
        begin = time.perf_counter()
        call()
        warm.append(time.perf_counter() - begin)
    found = {"name": name, "lower": lower, "upper": upper, "cold": cold, "warm": np.array(warm)}
    return {f"{key}{number}": value for key, value in found.items()}
