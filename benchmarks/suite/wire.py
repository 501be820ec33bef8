"""What goes through the door: a head in JSON, which tells the shapes, and float64 numbers; no
programs, no paths, and no more than a head allows.
"""

import json
import math
import socket
import struct

import numpy as np

HEAD = 1 << 16  # bytes of a head at most
MOST = 1 << 32  # bytes of numbers at most


def send(line: socket.socket, said: str, arrays: dict[str, np.ndarray]) -> None:
    """A sentence and arrays."""
    shapes = {name: np.shape(array) for name, array in arrays.items()}
    head = json.dumps({"said": said, "shapes": shapes}).encode()
    line.sendall(struct.pack("<I", len(head)) + head)
    for array in arrays.values():
        line.sendall(np.ascontiguousarray(array, "<f8").tobytes())


def receive(line: socket.socket, most: int = MOST) -> tuple[str, dict[str, np.ndarray]]:
    """The same from the other side. most: bytes of numbers. Raises ValueError, EOFError,
    OSError.
    """
    (size,) = struct.unpack("<I", _exactly(line, 4))
    if size > HEAD:
        raise ValueError(f"a head of at most {HEAD} bytes; got {size}")
    head = json.loads(_exactly(line, size))
    if not isinstance(head, dict) or not isinstance(head.get("shapes"), dict):
        raise ValueError("a head with shapes")
    shapes = {str(name): tuple(shape) for name, shape in head["shapes"].items()}
    if not all(type(n) is int and n >= 0 for shape in shapes.values() for n in shape):
        raise ValueError(f"shapes of whole numbers; got {shapes}")
    counts = {name: 8 * math.prod(shape) for name, shape in shapes.items()}
    if sum(counts.values()) > most:
        raise ValueError(f"at most {most} bytes of numbers; got {sum(counts.values())}")
    arrays = {}
    for name, shape in shapes.items():
        arrays[name] = np.frombuffer(_exactly(line, counts[name]), "<f8").reshape(shape)
    return str(head.get("said", "")), arrays


def _exactly(line: socket.socket, size: int) -> bytes:
    parts, left = [], size
    while left:
        part = line.recv(min(left, 1 << 20))
        if not part:
            raise EOFError("the other side ended")
        parts.append(part)
        left -= len(part)
    return b"".join(parts)
