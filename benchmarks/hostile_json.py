"""Malicious JSON and YAML files: damaged, too large or of another kind, for each reader."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from benchmarks.hostile_case import NOT_REGULAR, Case

_MIB = 2**20
JSON: Mapping[str, bytes] = {
    "cut": b'{"format": "x", "a": [',
    "longer": b'{"format": "x"}{}',
    "text": b"format: x",
    "utf16": '{"format": "x"}'.encode("utf-16"),
    "no_text": bytes(range(128, 256)) * 8,
    "list": b"[1, 2, 3]",
    "number": b"7",
    "null": b"null",
    "deep_lists": b"[" * 40_000,
    "deep_mappings": b'{"a":' * 20_000 + b"1" + b"}" * 20_000,
    "nested_100": b'{"format": ' + b"[" * 100 + b"]" * 100 + b"}",
    "empty_mappings": b"[" + b"{}," * (2 * _MIB // 3) + b"{}]",
    "empty_lists": b'{"a": [' + b"[]," * (2 * _MIB // 3) + b"[]]}",
    "many_numbers": b'{"a": [' + b"1," * _MIB + b"1]}",
    "many_names": b"{" + b",".join(b'"%d":0' % i for i in range(300_000)) + b"}",
    "whole_number_of_5000_digits": b'{"format_version": ' + b"9" * 5000 + b"}",
    "real_number_of_10000_digits": b'{"format_version": ' + b"9" * 10_000 + b".5}",
    "too_large_a_number": b'{"format_version": 1e400}',
    "minus_infinity": b'{"format_version": -Infinity}',
    "name_twice": b'{"format": "x", "format": "y"}',
    "surrogate": b'{"format": "\\ud800", "name": "\\udfff"}',
    "escapes": b'{"format": "\\u001b[2J\\u0007\\u202e"}',
    "long_text": b'{"format": "' + b"a" * (3 * _MIB) + b'"}',
    "long_name": b'{"' + b"a" * (3 * _MIB) + b'": 1}',
}
"""Contents that are not valid in any of the program's formats."""

YAML: Mapping[str, bytes] = {
    "cut": b"fog: {low: 40",
    "tab": b"fog:\n\tlow: 40",
    "no_text": bytes(range(128, 256)),
    "control_signs": b"fog: \x00\x07",
    "aliases": b"a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n",
    "merge_bomb": b"a: &a {x: 1}\n"
    + b"".join(
        b"%c: &%c {<<: [%s]}\n" % (i + 1, i + 1, b", ".join([b"*%c" % i] * 9))
        for i in range(97, 107)
    ),
    "endless": b"&a [*a]",
    "python_object": b"!!python/object/apply:os.system ['touch ran']",
    "python_name": b"- !!python/name:os.system",
    "binary": b"a: !!binary aGVsbG8=",
    "set": b"a: !!set {b, c}",
    "empty_integer": b'a: !!int ""',
    "wrong_flag": b'a: !!bool "x"',
    "date_of_the_first_year": b"a: 0001-01-01T00:00:00+23:59",
    "date_that_is_none": b"a: 2001-99-99",
    "hexadecimal_of_60000_digits": b"fog: 0x" + b"f" * 60_000,
    "sexagesimal_of_20000_parts": b"fog: 1" + b":1" * 20_000,
    "list_as_name": b"? [a, b]\n: 1",
    "mapping_as_name": b"{{a: 1}: 2}",
    "name_twice": b"fog: 1\nfog: 2",
    "two_documents": b"--- a\n--- b\n",
    "deep_lists": b"[" * 3000,
    "deep_mappings": b"{a: " * 500 + b"1" + b"}" * 500,
    "many_values": b"[" + b"1," * 20_000 + b"1]",
    "number": b"7",
    "infinite": b"fog: .inf",
    "not_a_number": b"fog: {low: .nan, unit: m of sight}",
    "too_large_a_file": b"# " + b"a" * 70_000 + b"\nfog: {low: 1}",
}
"""Contents that are valid data of another kind, or more than plain data."""


def hostile_json(folder: Path, checkpoint: Callable[[Path], Path]) -> list[Case]:
    """Write the files and return their cases.

    Args:
        folder: Folder of the files.
        checkpoint: Create a run's folder with a checkpoint.
    """
    cases = [
        *_for(folder, "certificate", JSON, ".json", _arguments("check", "certificate")),
        *_for(folder, "shifts", JSON, ".json", _arguments("verdict", "policy=good shifts")),
        *_for(folder, "domain", JSON, ".json", _arguments("verdict", "policy=good require_domain")),
        *_for(folder, "domain", YAML, ".yaml", _arguments("verdict", "policy=good require_domain")),
    ]
    for kind, contents in (("sweep", JSON), ("explanation", JSON)):
        for name, content in contents.items():
            cases.append(_in_folder(folder, kind, name, content))
    for name, content in YAML.items():
        run = checkpoint(folder / f"run_overrides_{name}")
        (run / ".hydra" / "overrides.yaml").write_bytes(content)
        cases.append((run.name, ["train", f"resume={run}"], "invalid overrides"))
    for name, content in JSON.items():
        run = checkpoint(folder / f"run_rounds_{name}")
        (run / ".hydra" / "overrides.yaml").write_text("- experiment=smoke\n- logger=csv\n")
        (run / "provable.json").write_bytes(content)
        command = ["train", f"resume={run}", "provable.rounds=1"]
        cases.append((run.name, command, "invalid rounds of a training"))
    return [*cases, *_required_domains(folder)]


def _arguments(command: str, setting: str) -> Callable[[Path], list[str]]:
    *before, last = setting.split()
    return lambda path: [command, *before, f"{last}={path}"]


def _for(
    folder: Path,
    kind: str,
    contents: Mapping[str, bytes],
    ending: str,
    command: Callable[[Path], list[str]],
) -> list[Case]:
    cases = []
    for name, content in contents.items():
        path = folder / f"{kind}_{name}{ending}"
        path.write_bytes(content)
        cases.append((path.name, command(path), f"instead of a {kind}: {name}"))
    for name, make in NOT_REGULAR.items():
        path = folder / f"{kind}_no_file_{name}{ending}"
        make(path)
        cases.append((path.name, command(path), "not a regular file"))
    return cases


def _in_folder(folder: Path, kind: str, name: str, content: bytes) -> Case:
    here = folder / f"{kind}_file_{name}"
    here.mkdir()
    (here / f"{kind}.json").write_bytes(content)
    if kind == "sweep":
        return here.name, ["sweep-report", f"folder={here}"], "an invalid sweep.json"
    return here.name, ["report", f"explanations={here}"], "an invalid explanation.json"


def _required_domains(folder: Path) -> list[Case]:
    """Write invalid required domains."""
    ranges: dict[str, Any] = {
        "unknown_axis": {"luck": {"low": 1, "unit": "x"}},
        "unknown_key": {"fog": {"low": 1, "unit": "m of sight", "eval": "x"}},
        "other_unit": {"fog": {"low": 1, "unit": "km"}},
        "no_end": {"fog": {"unit": "m of sight"}},
        "turned": {"fog": {"low": 90, "high": 40, "unit": "m of sight"}},
        "negative": {"fog": {"low": -1, "unit": "m of sight"}},
        "huge": {"fog": {"low": 10**18, "unit": "m of sight"}},
        "text": {"fog": {"low": "40", "unit": "m of sight"}},
        "flag": {"fog": {"low": True, "unit": "m of sight"}},
        "list": {"fog": {"low": [40], "unit": "m of sight"}},
        "axis_as_list": {"fog": [40, 100]},
        "nothing": {},
    }
    cases = []
    for name, content in ranges.items():
        path = folder / f"needs_{name}.json"
        path.write_text(json.dumps(content))
        command = ["verdict", "policy=good", f"require_domain={path}"]
        cases.append((path.name, command, "an invalid required domain"))
    return cases
