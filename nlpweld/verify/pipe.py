"""Arrays through pipes: each as eight bytes of length and the bytes of ``numpy.save``, never pickled."""

import io
import struct
from typing import IO

import numpy as np


def send(stream: IO[bytes], *arrays: np.ndarray) -> None:
    """Write arrays to a pipe."""
    for array in arrays:
        buffer = io.BytesIO()
        np.save(buffer, array, allow_pickle=False)
        stream.write(struct.pack("<Q", buffer.tell()))
        stream.write(buffer.getbuffer())
    stream.flush()


def receive(stream: IO[bytes], count: int) -> list[np.ndarray]:
    """Read arrays from a pipe.

    Raises:
        EOFError: the other side has gone.
    """
    arrays = []
    for _ in range(count):
        (size,) = struct.unpack("<Q", _exactly(stream, 8))
        arrays.append(np.load(io.BytesIO(_exactly(stream, size)), allow_pickle=False))
    return arrays


def _exactly(stream: IO[bytes], size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return data
