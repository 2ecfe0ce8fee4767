"""The float32 constants and the metadata of an ONNX file, read straight from its protobuf bytes.

onnxruntime does not give them out and the `onnx` package is only needed to train, so this walks the
few fields that lead there: ModelProto.graph (7), GraphProto.initializer (5), and of TensorProto
dims (1), data_type (2), name (8) and raw_data (9); ModelProto.metadata_props (14), key (1), value (2).
"""

from collections.abc import Iterator

import numpy as np

from companion.messages import FloatArray

GRAPH, INITIALIZER, DIMS, DATA_TYPE, NAME, RAW = 7, 5, 1, 2, 8, 9
METADATA, KEY, VALUE = 14, 1, 2
FLOAT = 1


def float_constants(content: bytes) -> dict[str, FloatArray]:
    """Name to value, as float64; raises `ValueError` on bytes that are no ONNX file."""
    found: dict[str, FloatArray] = {}
    for field, graph in _fields(content):
        if field == GRAPH and isinstance(graph, bytes):
            for inner, tensor in _fields(graph):
                if inner == INITIALIZER and isinstance(tensor, bytes):
                    found.update(_tensor(tensor))
    return found


def metadata_text(content: bytes, key: str) -> str | None:
    """The metadata entry of that key."""
    for field, entry in _fields(content):
        if field == METADATA and isinstance(entry, bytes):
            pair = dict(_fields(entry))
            value = pair.get(VALUE)
            if pair.get(KEY) == key.encode() and isinstance(value, bytes):
                return value.decode()
    return None


def _tensor(data: bytes) -> dict[str, FloatArray]:
    dims: list[int] = []
    kind, name, raw = 0, "", b""
    for field, value in _fields(data):
        if field == DIMS:
            dims += [value] if isinstance(value, int) else list(_varints(value))
        elif field == DATA_TYPE and isinstance(value, int):
            kind = value
        elif field == NAME and isinstance(value, bytes):
            name = value.decode()
        elif field == RAW and isinstance(value, bytes):
            raw = value
    if kind != FLOAT:
        return {}
    return {name: np.frombuffer(raw, "<f4").astype(np.float64).reshape(dims)}


def _fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    at = 0
    while at < len(data):
        tag, at = _varint(data, at)
        wire = tag & 7
        if wire == 0:
            value, at = _varint(data, at)
            yield tag >> 3, value
            continue
        if wire == 2:
            size, at = _varint(data, at)
        elif wire in (1, 5):
            size = 8 if wire == 1 else 4
        else:
            raise ValueError(f"wire type {wire}")
        if at + size > len(data):
            raise ValueError("a field runs past the end")
        yield tag >> 3, data[at : at + size]
        at += size


def _varints(data: bytes) -> Iterator[int]:
    at = 0
    while at < len(data):
        value, at = _varint(data, at)
        yield value


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        if at >= len(data) or shift > 63:
            raise ValueError("a number runs past the end")
        byte = data[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if not byte & 0x80:
            return value, at
