"""Rows of booleans as 64-bit words."""

import numpy as np


def pack(rows: np.ndarray) -> np.ndarray:
    """Bool (r, m) -> uint64 (r, words), bit c of word w is column 64 w + c; spare bits are 0."""
    as_bytes = np.packbits(rows, axis=1, bitorder="little")
    words = np.zeros((len(rows), -(-rows.shape[1] // 64) * 8), np.uint8)
    words[:, : as_bytes.shape[1]] = as_bytes
    return words.view("<u8").astype(np.uint64, copy=False)


def unpack(words: np.ndarray, n_columns: int) -> np.ndarray:
    """uint64 (r, words) -> bool (r, n_columns)."""
    as_bytes = np.ascontiguousarray(words.astype("<u8", copy=False)).view(np.uint8)
    return np.unpackbits(as_bytes, axis=1, count=n_columns, bitorder="little").view(bool)


def hash_words(words: np.ndarray) -> np.ndarray:
    """uint64 (r, words) -> (r,): equal rows, equal hash; different rows seldom."""
    factors = np.random.default_rng(0).integers(1, 2**63, words.shape[1], dtype=np.uint64) | np.uint64(1)
    return ((words ^ (words >> np.uint64(29))) * factors).sum(axis=1, dtype=np.uint64)
