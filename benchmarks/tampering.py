"""Tampered certificates, and how many of them the checker refuses."""

import copy
import json
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from benchmarks.tampered_consistent import CONSISTENT
from benchmarks.tampered_inconsistent import INCONSISTENT
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verification.check import check

TEXTS: dict[str, Callable[[bytes], bytes]] = {
    "cut in half": lambda text: text[: len(text) // 2],
    "last sign missing": lambda text: text[:-1],
    "empty": lambda text: b"",
    "longer": lambda text: text + b"{}",
    "no text": lambda text: b"\xff\xfe" + text,
    "a name twice": lambda text: b'{"finished": true, ' + text[1:],
    "too deep": lambda text: text[:-1] + b', "more": ' + b"[" * 10**5 + b"]" * 10**5 + b"}",
    "infinite share": lambda text: re.sub(rb'"share": [^,]+', b'"share": 1e999', text, count=1),
    "endless number": lambda text: re.sub(
        rb'"share": [^,]+', b'"share": 1' + b"0" * 999, text, count=1
    ),
}
"""Changes of the file's bytes, by name."""


def tampered(data: dict[str, Any]) -> Iterator[tuple[str, bytes]]:
    """Yield names and contents of tampered files, without duplicates.

    Changes that do not apply to this certificate are left out.

    Args:
        data: Content of a valid certificate, which is not changed.
    """
    valid = json.dumps(data).encode()
    changes = {**INCONSISTENT, **CONSISTENT}.items()
    files = {name: json.dumps(change(copy.deepcopy(data))).encode() for name, change in changes}
    files |= {name: change(valid) for name, change in TEXTS.items()}
    seen = {valid}
    for name, content in files.items():
        if content not in seen:
            seen.add(content)
            yield name, content


def count_refused(
    certificates: Mapping[Path, str | Path | None], few: int = 400, flights: int = 2000
) -> dict[str, Any]:
    """Tamper with valid certificates in all ways and check the results.

    Args:
        certificates: Files and their policies; None means the policy that the file names.
        few: Number of episodes of a first, short check.
        flights: Number of episodes of a full check, if the short check accepts the file.

    Returns:
        "tampered_refused" and "tampered_total", numbers of files, and "tampered_accepted", the
        names of those that are accepted.
    """
    accepted, total = [], 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "certificate.json"
        for certificate, policy in certificates.items():
            for name, content in tampered(json.loads(certificate.read_bytes())):
                path.write_bytes(content)
                total += 1
                if not (is_refused(path, policy, few) or is_refused(path, policy, flights)):
                    accepted.append(f"{certificate}: {name}")
    return {
        "tampered_refused": total - len(accepted),
        "tampered_total": total,
        "tampered_accepted": accepted,
    }


def is_refused(path: Path, policy: str | Path | None = None, flights: int = 2000) -> bool:
    """Return whether the checker refuses a file as invalid or as false."""
    try:
        return not check(path, policy, flights=flights, seed=0, progress=silent).accepted
    except InputError:
        return True
