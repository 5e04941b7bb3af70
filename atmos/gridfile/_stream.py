"""The bytes of an OpenVDB file: numbers, texts, and arrays that may be compressed."""

import struct
import zlib
from typing import Any

import numpy as np
from numcodecs.registry import get_codec


ZIP, MASK, BLOSC = 1, 2, 4


class Stream:
    """A place in a file. What reads past the end raises `ValueError`."""

    def __init__(self, raw: bytes):
        self.raw, self.at = raw, 0

    def take(self, size: int) -> bytes:
        """The next so many bytes."""
        if not 0 <= self.at <= self.at + size <= len(self.raw):
            raise ValueError("is cut short or damaged")
        self.at += size
        return self.raw[self.at - size : self.at]

    def number(self, kind: str) -> Any:
        """The next number, of a kind that `struct` knows."""
        return struct.unpack(f"<{kind}", self.take(struct.calcsize(kind)))[0]

    def text(self) -> str:
        """The next text, that says how long it is."""
        return self.take(self.number("I")).decode("utf-8", "replace")

    def array(self, dtype: np.dtype, count: int) -> np.ndarray:
        """The next so many values as they stand."""
        return np.frombuffer(self.take(dtype.itemsize * count), dtype)

    def mask(self, count: int) -> np.ndarray:
        """The next so many bits."""
        bits = np.frombuffer(self.take(count // 8), np.uint8)
        return np.unpackbits(bits, bitorder="little").astype(bool)

    def packed(self, dtype: np.dtype, count: int, compression: int) -> np.ndarray:
        """The next so many values, that may be compressed."""
        if not compression & (ZIP | BLOSC):
            return self.array(dtype, count)
        size = self.number("q")
        if size <= 0:  # what would not have become smaller
            raw = self.take(-size)
        elif compression & BLOSC:
            raw = _unblosc(self.take(size), dtype.itemsize * count)
        else:
            raw = _unzip(self.take(size), dtype.itemsize * count)
        if len(raw) != dtype.itemsize * count:
            raise ValueError("is cut short or damaged")
        return np.frombuffer(raw, dtype)


def _unzip(raw: bytes, size: int) -> bytes:
    try:
        return zlib.decompressobj().decompress(raw, size)
    except zlib.error as error:
        raise ValueError("is cut short or damaged") from error


def _unblosc(raw: bytes, size: int) -> bytes:
    # Its header says how long the values are, and how long it is itself.
    if len(raw) < 16 or struct.unpack("<4xI4xI", raw[:16]) != (size, len(raw)):
        raise ValueError("is cut short or damaged")
    if not size:
        return b""
    try:
        return bytes(get_codec({"id": "blosc"}).decode(raw) or b"")
    except RuntimeError as error:
        raise ValueError("is cut short or damaged") from error
