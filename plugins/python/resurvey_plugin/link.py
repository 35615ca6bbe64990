"""The two ends that a plugin finds when it starts: lines on a socket, arrays in shared memory (docs/plugin-wire.md)."""

import json
import mmap
import os
import socket
import sys

import numpy as np

from .records import RAY_HIT, VIEW_FEATURE
from .words import line

_MAGIC = b"RSVWIRE1"
_CANCEL_AT = 8
_SCORED_AT = 16
_ALIGNED = 64
_DTYPES = {"|u1": np.dtype("u1"), "<u4": np.dtype("<u4"), "<f4": np.dtype("<f4"), "<f8": np.dtype("<f8"),
           "|V16": VIEW_FEATURE, "|V72": RAY_HIT}


class Ended(Exception):
    """The host has closed the wire."""


class Link:
    """The wire and the memory behind it."""

    def __init__(self, wire, memory_file):
        self._wire = wire
        self._file = memory_file
        self._unread = bytearray()
        self._memory = self._header = mmap.mmap(memory_file, 0)
        if self._header[:8] != _MAGIC:
            raise ValueError(f"expected shared memory that begins with {_MAGIC!r}, found {self._header[:8]!r}")
        self._scored = np.ndarray((), "<u4", self._header, _SCORED_AT)
        self._count = int(self._scored)

    @classmethod
    def of_this_process(cls):
        """Takes both over, and keeps prints and readers of standard input away from them."""
        memory = os.dup(0)
        wire = socket.socket(fileno=os.dup(1))
        os.dup2(2, 1)
        nothing = os.open(os.devnull, os.O_RDONLY)
        os.dup2(nothing, 0)
        os.close(nothing)
        # Last words must be out when the process is killed.
        for stream in (sys.stdout, sys.stderr):
            stream.reconfigure(line_buffering=True)
        return cls(wire, memory)

    def send(self, name, value):
        """Sends a message."""
        try:
            self._wire.sendall(line(name, value))
        except (BrokenPipeError, ConnectionResetError):
            raise Ended from None

    def receive(self):
        """Name and value of the next message."""
        end = self._unread.find(b"\n")
        while end < 0:
            looked = len(self._unread)
            try:
                more = self._wire.recv(1 << 16)
            except ConnectionResetError:
                raise Ended from None
            if not more:
                raise Ended
            self._unread += more
            end = self._unread.find(b"\n", looked)
        (name, value), = json.loads(self._unread[:end]).items()
        del self._unread[:end + 1]
        return name, value

    def grown_to(self, size):
        """Maps the memory again where it has grown; what is mapped stays."""
        if size > len(self._memory):
            self._memory = mmap.mmap(self._file, size)

    def lent(self, words):
        """An array that the host lends: read-only."""
        array = self.place(words)
        array.flags.writeable = False
        return array

    def place(self, words):
        """An array of the memory to write to."""
        if 0 in words["shape"]:
            return np.empty(tuple(words["shape"]), _DTYPES[words["dtype"]])
        return np.ndarray(tuple(words["shape"]), _DTYPES[words["dtype"]], self._memory, words["offset"],
                          tuple(words["strides"]))

    def put(self, array, offset):
        """Writes an array into the memory; gives its words and where the next may lie."""
        array = np.ascontiguousarray(array)
        words = {"dtype": array.dtype.str, "shape": list(array.shape), "strides": list(array.strides), "offset": offset}
        self.place(words)[...] = array
        return words, offset + (array.nbytes + _ALIGNED - 1) // _ALIGNED * _ALIGNED

    def cancelled(self):
        """Whether the host wants the call to end."""
        return self._header[_CANCEL_AT] != 0

    def scored_one(self):
        """Tells the host that one more view is scored."""
        self._count = (self._count + 1) & 0xFFFFFFFF
        self._scored[...] = self._count
