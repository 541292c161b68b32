"""Malicious array archives: false sizes, types, indices or counts."""

import io
import json
import shutil
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hostile_case import NOT_REGULAR, Case, npz, put, zipped, zipped_zeros
from drone_rl.config.training import TrainSettings
from drone_rl.training.demonstrations import Demonstration, FlightConditions

_NUMBERS = {"format": "drone_rl explanation", "format_version": 3, "name": "x"}


def hostile_arrays(folder: Path) -> list[Case]:
    """Create folders of explanations, each with one malicious archive; return their cases.

    Args:
        folder: Parent folder.
    """
    cases, archives = [], _arrays()
    for file, contents in (("arrays", archives), ("dataset", _data())):
        for name, content in contents.items():
            here = folder / f"explanation_{file}_{name}"
            here.mkdir()
            (here / "explanation.json").write_text(json.dumps(_NUMBERS))
            for other in ("arrays", "dataset"):
                (here / f"{other}.npz").write_bytes(content if other == file else _npz())
            cases.append(
                (here.name, ["report", f"explanations={here}"], "a malicious array archive")
            )
    return [*cases, *_together(folder), *_numbers(folder), *_demonstrations(folder, archives)]


def _arrays() -> dict[str, bytes]:
    """Return archives with invalid structure or invalid headers, by name."""
    zeros = np.zeros
    headers: dict[str, Any] = {
        "dimensions_of_0": ((0, 2**40), "<f8", b""),
        "negative": ((-1, 3), "<f8", bytes(24)),
        "dimensions_30": ((1,) * 30, "<f8", bytes(8)),
        "more_than_there_is": ((2**40,), "<f8", bytes(8)),
        "overflow": ((2**40, 2**40), "<f8", b""),
        "objects": ((1,), "|O", bytes(8)),
        "complex": ((1,), "<c16", bytes(16)),
        "records": ((1,), "[('a', '<f8')]", bytes(8)),
        "dates": ((1,), "<M8[s]", bytes(8)),
        "raw": ((1,), "|V8", bytes(8)),
        "no_characters": ((1,), "<U1", b"\xff\xff\xff\x7f"),
        "call": ("__import__('os').system('touch ran')", "<f8", bytes(8)),
    }
    archives = {name: zipped({"a.npy": _npy(*of)}) for name, of in headers.items()}
    return archives | {
        "long_header": zipped({"a.npy": _npy((1,), "<f8" + " " * 60_000, bytes(8))}),
        "version_3": zipped({"a.npy": _npy((1,), "<f8", bytes(8)).replace(b"Y\x01", b"Y\x03", 1)}),
        "no_array": zipped({"a.npy": b"hello"}),
        "unpacks_to_1_gib": _npz_of_zeros((2**27,), "<f8", 2**30),
        "longer_than_its_directory_says": _shorter(2**29),
        "many_files": zipped({f"{i}.npy": b"" for i in range(10_001)}),
        "one_content_for_all": _overlapping(),
        "method": zipped({"a.npy": b"x"}).replace(b"\x00\x00\x00\x00\x21", b"\x00\x00\x0e\x00\x21"),
        "encrypted": _flagged(),
        "checksum": zipped({"a.npy": _npy((1,), "<f8", b"12345678")}).replace(
            b"12345678", b"12345679"
        ),
        "only_a_directory": b"PK\x05\x06" + bytes(18),
        "directory_elsewhere": b"PK\x05\x06" + struct.pack("<4H2LH", 0, 0, 9, 9, 2**31, 2**31, 0),
        "film_flat": _npz(film_frames=zeros((4, 4), np.uint8)),
        "film_of_reals": _npz(film_frames=zeros((1, 4, 4, 3))),
        "film_wide": _npz(film_frames=zeros((1, 1, 2**20, 3), np.uint8)),
        "film_actions": _npz(film_actions=np.array([2**40])),
        "heights": _npz(response_height=zeros(10**6)),
        "outlines": _npz(places_points=zeros((10**6, 2))),
        "ends": _npz(places_ends=zeros(10**6, np.int64)),
        "map_of_3": _npz(tsne_features=zeros((9, 3))),
        "map_of_texts": _npz(tsne_pixels=np.array([["a", "b"]])),
        "class_model_large": _npz(class_model_logit=zeros((1, 1, 4096, 4096), np.float16)),
        "strips": _npz(shifts_fog=zeros((6, 2000, 2000, 3), np.uint8)),
        "patches": _npz(patch_effects=zeros((2000, 2000))),
        "many_arrays": _npz(**{f"x{i}": zeros(1) for i in range(3000)}),
    }


def _data() -> dict[str, bytes]:
    """Return archives with invalid counts, indices or frames, by name."""
    return {
        "episode_2_33": _npz(**{"flights/episode": np.array([2**33])}),
        "episode_2_40": _npz(**{"flights/episode": np.array([0, 2**40])}),
        "episode_2_62": _npz(**{"flights/episode": np.array([2**62], np.uint64)}),
        "episode_negative": _npz(**{"flights/episode": np.array([-1, 0])}),
        "episode_beyond_its_steps": _npz(**{"flights/episode": np.array([0, 5])}),
        "episode_of_reals": _npz(**{"flights/episode": np.zeros(3)}),
        "episode_of_two_dimensions": _npz(**{"flights/episode": np.zeros((3, 3), int)}),
        "frame_episode": _npz(episode=np.array([2**40])),
        "frame_step": _npz(step=np.array([-(2**40)])),
        "action": _npz(actions=np.array([99])),
        "action_of_texts": _npz(actions=np.array(["left"])),
        "frames_gray": _npz(frames=np.zeros((3, 4, 4), np.uint8)),
        "frames_of_4_channels": _npz(frames=np.zeros((3, 4, 4, 4), np.uint8)),
        "frames_wide": _npz(frames=np.zeros((1, 1, 2**22, 3), np.uint8)),
        "frames_of_no_height": zipped({"frames.npy": _npy((1, 2**30, 0, 3), "|u1", b"")}),
        "frames_of_256_mib": _npz_of_zeros(
            (342, 512, 512, 3), "|u1", 342 * 512 * 512 * 3, "frames"
        ),
        "probabilities_of_2_22": _npz(probabilities=np.zeros((1, 2**22), np.float32)),
        "meta_of_objects": zipped({"meta.npy": _npy((1,), "|O", bytes(8))}),
    }


def _together(folder: Path) -> list[Case]:
    """Create archives that are small enough individually, but too large together."""
    here = folder / "explanation_arrays_two_of_2_28"
    here.mkdir()
    (here / "explanation.json").write_text(json.dumps(_NUMBERS))
    half = _npz_of_zeros((2**25,), "<f8", 2**28)
    for other in ("arrays", "dataset"):
        (here / f"{other}.npz").write_bytes(half)
    several = [here.with_name(f"{here.name}_{i}") for i in range(3)]
    for copy in several:
        shutil.copytree(here, copy)
        (copy / "dataset.npz").write_bytes(_npz())
    names = ",".join(map(str, several))
    return [
        (here.name, ["report", f"explanations={here}"], "two archives of 256 MiB"),
        (f"{here.name}_3", ["report", f"explanations=[{names}]"], "three archives of 256 MiB"),
    ]


def _numbers(folder: Path) -> list[Case]:
    """Create explanations with too long lists, mappings and texts."""
    parts: dict[str, Any] = {
        "key_steps": {"attribution": {"film": {"key_steps": [{"step": 0, "why": "x"}] * 1000}}},
        "methods": {"truth": {"methods": {str(i): {} for i in range(1000)}}},
        "curves": {"truth": {"curves": {str(i): {} for i in range(1000)}}},
        "conditions": {"shifts": {"axes": {str(i): {} for i in range(1000)}}},
        "long_list": {"more": [0] * 30_000},
        "actions": {"actions": {"names": ["a"] * 1000}},
        "terms": {"terms": {"goal": "x" * 10**6}},
        "name": {"name": "x" * 10**6},
        "name_of_lines": {"name": "a\nb"},
    }
    cases = []
    for name, part in parts.items():
        here = folder / f"explanation_numbers_{name}"
        here.mkdir()
        (here / "explanation.json").write_text(json.dumps({**_NUMBERS, **part}))
        for other in ("arrays", "dataset"):
            (here / f"{other}.npz").write_bytes(_npz())
        cases.append((here.name, ["report", f"explanations={here}"], "too much to show"))
    return cases


def _demonstrations(folder: Path, archives: Mapping[str, bytes]) -> list[Case]:
    """Create folders of demonstrations to train from, each with one malicious file or archive."""
    whole = _flight()
    changes: dict[str, Any] = {
        "pickle": {"images": np.array([{}], object)},
        "shape": {"images": whole["images"][:, :, :4]},
        "type": {"images": whole["images"].astype(np.float32)},
        "rewards_nan": {"rewards": np.array([np.nan], np.float32)},
        "action_99": {"actions": np.array([99])},
        "further": {"more": np.zeros(1)},
        "text": {"about": np.array("hello")},
        "nested": {"about": np.array("[" * 10**5)},
        "values": {"about": np.array("[" + "0," * 10**6 + "0]")},
        "twice": {"about": np.array('{"format": 1, "format": 1}')},
        "camera_large": {"about": np.array(str(whole["about"]).replace("64", str(10**18)))},
        "task": {"about": np.array(str(whole["about"]).replace("num_cubes", "__class__"))},
        "lines": {"about": np.array(str(whole["about"]).replace("person", "a\\nb"))},
    }
    contents: dict[str, Any] = {
        **{f"archive_{name}": content for name, content in archives.items()},
        **{name: npz({**whole, **change}) for name, change in changes.items()},
        "frames_of_384_mib": _npz_of_zeros((2**15, 64, 64, 3), "|u1", 3 * 2**27, "images"),
        **NOT_REGULAR,
    }
    cases = []
    for name, content in contents.items():
        here = folder / f"demonstration_{name}"
        here.mkdir()
        put(here / "flight_00000.npz", content)
        command = ["train", f"demonstrations={here}", "logger=csv"]
        cases.append((here.name, command, "a malicious demonstration"))
    return cases


def _flight() -> dict[str, np.ndarray]:
    """Return the arrays of a valid demonstration of one step."""
    one = Demonstration(
        FlightConditions.of(TrainSettings()),
        images=np.zeros((1, 25, 64, 3), np.uint8),
        actions=np.zeros(1, np.int64),
        rewards=np.zeros(1, np.float32),
        done=np.ones(1, bool),
    )
    return dict(np.load(io.BytesIO(one.to_bytes())))


def _npz(**arrays: np.ndarray) -> bytes:
    return npz(arrays or {"a": np.zeros(3)})


def _npy(shape: Any, dtype: str, data: bytes) -> bytes:
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


def _npz_of_zeros(shape: Any, dtype: str, size: int, name: str = "a") -> bytes:
    """Return a compressed file of one array of zeros, which takes `size` bytes."""
    return zipped_zeros(f"{name}.npy", _npy(shape, dtype, b""), size)


def _shorter(size: int) -> bytes:
    """Return an archive whose directory declares an unpacked size of 100 bytes."""
    content = _npz_of_zeros((size // 8,), "<f8", size)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        unpacked = archive.infolist()[0].file_size
    return content.replace(struct.pack("<L", unpacked), struct.pack("<L", 100))


def _overlapping() -> bytes:
    """Return an archive in which 1000 entries share the content of the first, a megabyte."""
    content = zipped({"a.npy": bytes(2**20)}, zipfile.ZIP_DEFLATED)
    begin = content.index(b"PK\x01\x02")
    end = content.index(b"PK\x05\x06")
    entry = content[begin:end]
    entries = b"".join(entry.replace(b"a.npy", b"%05d" % i) for i in range(1000))
    last = struct.pack("<4s4H2LH", b"PK\x05\x06", 0, 0, 1000, 1000, len(entries), begin, 0)
    return content[:begin] + entries + last


def _flagged() -> bytes:
    """Return an archive whose entry is flagged as encrypted."""
    content = bytearray(zipped({"a.npy": _npy((1,), "<f8", bytes(8))}))
    content[content.index(b"PK\x01\x02") + 8] |= 1
    content[6] |= 1
    return bytes(content)
