"""Malicious policy files: false storages, sizes or types of tensors, and malicious pickles."""

import json
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import save

from benchmarks.hostile_case import Case, zipped

_STORAGES = {
    **{"Float": 4, "Double": 8, "Half": 2, "BFloat16": 2, "Long": 8, "Int": 4},
    **{"Short": 2, "Char": 1, "Byte": 1, "Bool": 1, "ComplexFloat": 8, "ComplexDouble": 16},
}
"""Bytes of an element by storage type."""
_COMMANDS = ("chain", "prove", "places", "shifts", "bodies", "verdict", "evaluate", "export")


def hostile_policies(
    folder: Path, weights: Mapping[str, torch.Tensor], texts: Mapping[str, str]
) -> list[Case]:
    """Write the files and return their cases.

    Args:
        folder: Folder of the files.
        weights: Weights of a valid policy.
        texts: Metadata of its exported file.
    """
    files = {f"storage_{name}.pt": content for name, content in _storages().items()}
    files |= {f"program_{name}.pt": content for name, content in _programs().items()}
    files |= {f"header_{n}.safetensors": c for n, c in _headers(weights, texts).items()}
    cases = [_case(folder, name, content) for name, content in files.items()]
    return [*cases, _twelve_types(folder)]


def _case(folder: Path, name: str, content: bytes) -> Case:
    path = folder / name
    path.write_bytes(content)
    command = _COMMANDS[sum(map(ord, name)) % len(_COMMANDS)]
    return name, [command, f"policy={path}"], "malicious tensors"


def _twelve_types(folder: Path) -> Case:
    """Write a checkpoint that refers to one storage of 256 MiB with every type."""
    path, size = folder / "storage_twelve_types.pt", 2**28 - 2**16
    tensors = {name: _tensor(name, size // each, (4,)) for name, each in _STORAGES.items()}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a/data.pkl", _state(tensors))
        with archive.open("a/data/0", "w") as file:
            for _ in range(size // 2**16):
                file.write(bytes(2**16))
    return path.name, ["verdict", f"policy={path}"], "one storage of 256 MiB as twelve types"


def _storages() -> dict[str, bytes]:
    four = bytes(16)
    contents: dict[str, tuple[bytes, bytes]] = {
        "two_types": (_state({"a": _tensor("Float", 4, (4,)), "b": _tensor("Int", 4, (4,))}), four),
        "two_lengths": (
            _state({"a": _tensor("Float", 4, (4,)), "b": _tensor("Float", 8, (8,))}),
            four,
        ),
        "shorter": (_state({"a": _tensor("Float", 8, (8,))}), four),
        "longer": (_state({"a": _tensor("Float", 2, (2,))}), four),
        "stride_0": (_state({"a": _tensor("Float", 4, (2**20, 2**20), (0, 0))}), four),
        "stride_negative": (_state({"a": _tensor("Float", 4, (4,), (-1,))}), four),
        "stride_missing": (_state({"a": _tensor("Float", 4, (2, 2), (1,))}), four),
        "size_negative": (_state({"a": _tensor("Float", 4, (-4,))}), four),
        "size_of_texts": (_state({"a": _tensor("Float", 4, ("x",))}), four),
        "dimensions_64": (_state({"a": _tensor("Float", 4, (1,) * 64)}), four),
        "offset": (_state({"a": _tensor("Float", 4, (4,), offset=2)}), four),
        "offset_negative": (_state({"a": _tensor("Float", 4, (1,), offset=-1)}), four),
        "of_2_62": (_state({"a": _tensor("Float", 2**62, (4,))}), four),
        "of_a_type_unknown": (_state({"a": _tensor("Quantized", 4, (4,))}), four),
        "absent": (_state({"a": _tensor("Float", 4, (4,), key="7")}), four),
        "key_as_path": (_state({"a": _tensor("Float", 4, (4,), key="../../x")}), four),
    }
    return {name: _archive(program, data) for name, (program, data) in contents.items()}


def _programs() -> dict[str, bytes]:
    """Return checkpoints with pickles that are slow, large or not plain data, by name."""
    laughs = b"\x80\x02]q\x00" + b"".join(
        b"](" + b"h" + bytes([i]) * 1 + (b"h" + bytes([i])) * 9 + b"eq" + bytes([i + 1])
        for i in range(30)
    )
    programs = {
        "of_a_million_nones": b"\x80\x02" + b"N" * (2**20 - 3) + b".",
        "of_two_million_nones": b"\x80\x02" + b"N" * 2**21 + b".",
        "of_empty_mappings": b"\x80\x02(" + b"}" * (2**20 - 8) + b"l.",
        "of_marks": b"\x80\x02" + b"(" * (2**20 - 4) + b".",
        "laughs": laughs + b".",
        "long_integer": b"\x80\x02\x8a\xff" + b"\x7f" * 255 + b".",
        "longer_integer": b"\x80\x02\x8b\xff\xff\xff\x7f.",
        "bytes": b"\x80\x03B\xff\xff\xff\x7f.",
        "frame": b"\x80\x04\x95\xff\xff\xff\xff\xff\xff\xff\x7f.",
        "unhashable": b"\x80\x02}(]K\x01u.",
        "itself": b"\x80\x02]q\x00h\x00a.",
        "mapping_in_itself": b"\x80\x02}q\x00(X\x01\x00\x00\x00ah\x00u.",
        "surrogates": b"\x80\x02X\x03\x00\x00\x00\xed\xa0\x80.",
        "nothing": b"",
        "stop": b".",
        "extension": b"\x80\x02\x82\x01.",
        "instance": b"(ios\nsystem\n.",
        "object": b"\x80\x02cbuiltins\nlist\n)\x81.",
        "dotted_name": b"\x80\x04\x8c\x05torch\x8c\x11storage.os.system\x93.",
        "reference": b"\x80\x02X\x01\x00\x00\x00aQ.",
        "call_of_a_text": b"\x80\x02X\x01\x00\x00\x00a)R.",
    }
    archives = {name: _archive(program) for name, program in programs.items()}
    whole = _state({"a": _tensor("Float", 4, (4,))})
    members = {
        "path_above": {"../data.pkl": whole},
        "absolute_path": {"/data.pkl": whole},
        "two_folders": {"a/data.pkl": whole, "b/data.pkl": whole},
        "big_endian": {"a/data.pkl": whole, "a/byteorder": b"big", "a/data/0": bytes(16)},
        "no_program": {"a/data/0": bytes(16)},
        "module": {"a/data.pkl": whole, "a/code/__torch__.py": b"import os"},
    }
    return archives | {name: zipped(content) for name, content in members.items()}


def _headers(weights: Mapping[str, torch.Tensor], texts: Mapping[str, str]) -> dict[str, bytes]:
    content = save(dict(weights), dict(texts))
    size = int.from_bytes(content[:8], "little")
    header, numbers = json.loads(content[8 : 8 + size]), content[8 + size :]
    first, second = [name for name in header if name != "__metadata__"][:2]

    def file(**changed: Any) -> bytes:
        return _safetensors(json.dumps({**header, **changed}).encode(), numbers)

    def one(**changed: Any) -> bytes:
        return file(**{first: {**header[first], **changed}})

    many = {f"x{i}": {"dtype": "F32", "shape": [0], "data_offsets": [0, 0]} for i in range(9000)}
    return {
        "overlapping": one(data_offsets=header[second]["data_offsets"]),
        "beyond": one(data_offsets=[0, 2**40]),
        "turned": one(data_offsets=[64, 0]),
        "negative_offset": one(data_offsets=[-4, 0]),
        "gap": _safetensors(json.dumps(header).encode(), bytes(64) + numbers),
        "negative_shape": one(shape=[-1]),
        "shape_overflow": one(shape=[2**40, 2**40]),
        "shape_of_texts": one(shape=["2"]),
        "shape_of_0": one(shape=[0, 2**40]),
        "dimensions_1000": one(shape=[1] * 1000),
        "type_unknown": one(dtype="X32"),
        "type_double": one(dtype="F64"),
        "more_keys": one(device="cuda"),
        "entry_no_mapping": file(**{first: 5}),
        "metadata_no_texts": file(__metadata__={**header["__metadata__"], "about": 5}),
        "metadata_list": file(__metadata__=[]),
        "many_tensors": file(**many),
        "escape_in_a_name": file(**{"\x1b[2J": header[first]}),
        "of_100_mib": struct.pack("<Q", 100 * 2**20) + b"{" + b" " * (100 * 2**20 - 2) + b"}",
        "of_2_63": struct.pack("<Q", 2**63) + b"{}",
        "of_spaces": _safetensors(b" " * 1000, numbers),
        "no_text": _safetensors(b"\xff" * 100, numbers),
        "deep": _safetensors(b'{"a":' * 9000 + b"1" + b"}" * 9000, numbers),
    }


def _safetensors(header: bytes, numbers: bytes) -> bytes:
    return struct.pack("<Q", len(header)) + header + numbers


def _archive(program: bytes, data: bytes = b"") -> bytes:
    return zipped({"a/data.pkl": program, "a/data/0": data})


def _state(tensors: Mapping[str, bytes]) -> bytes:
    """Return the pickle of a checkpoint with these tensors as its weights."""
    entries = b"".join(_text(name) + tensor for name, tensor in tensors.items())
    about = _text("format") + _text("drone_rl checkpoint") + _text("format_version") + b"K\x02"
    return b"\x80\x02}(" + about + _text("policy") + b"}(" + entries + b"uu."


def _tensor(
    kind: str,
    length: int,
    size: tuple[Any, ...],
    stride: tuple[int, ...] | None = None,
    *,
    offset: int = 0,
    key: str = "0",
) -> bytes:
    """Return the pickle instructions of a tensor."""
    stride = stride if stride is not None else (1,) * len(size)
    storage = b"(" + _text("storage") + b"ctorch\n%sStorage\n" % kind.encode() + _text(key)
    storage += _text("cpu") + _whole(length) + b"tQ"
    shape = b"".join(b"(" + b"".join(map(_value, numbers)) + b"t" for numbers in (size, stride))
    rest = b"\x89ccollections\nOrderedDict\n)R"
    return b"ctorch._utils\n_rebuild_tensor_v2\n(" + storage + _whole(offset) + shape + rest + b"tR"


def _value(value: Any) -> bytes:
    return _text(value) if isinstance(value, str) else _whole(value)


def _text(text: str) -> bytes:
    return b"X" + struct.pack("<I", len(text)) + text.encode()


def _whole(number: int) -> bytes:
    return b"\x8a\x09" + number.to_bytes(9, "little", signed=True)
