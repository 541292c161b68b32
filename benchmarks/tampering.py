"""Certificates that say what is not so, and how many of them the checker refuses."""

import copy
import json
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from benchmarks.tampered_consistent import WHOLES
from benchmarks.tampered_inconsistent import PARTS
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
"""What can be done to the file."""


def tampered(data: dict[str, Any]) -> Iterator[tuple[str, bytes]]:
    """Files that lie, by name, no two alike; what can't be done to this certificate is left out.

    Args:
        data: Of a true certificate; left as it is.
    """
    true = json.dumps(data).encode()
    ways = {**PARTS, **WHOLES}.items()
    made = {name: json.dumps(way(copy.deepcopy(data))).encode() for name, way in ways}
    made |= {name: change(true) for name, change in TEXTS.items()}
    seen = {true}
    for name, content in made.items():
        if content not in seen:
            seen.add(content)
            yield name, content


def count_refused(
    certificates: Mapping[Path, str | Path | None], few: int = 400, flights: int = 2000
) -> dict[str, Any]:
    """Tampers with true certificates in all ways, and checks what comes of it.

    Args:
        certificates: Files, each with its policy; none takes the one that it names.
        few: Flights after which most are refused.
        flights: As many as `drone-rl check` flies, for those that are not.

    Returns:
        "tampered_refused", "tampered_total", and the "tampered_accepted" by name.
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
    """Whether the checker refuses a file, be it as none of its kind or as one that lies."""
    try:
        return not check(path, policy, flights=flights, seed=0, progress=silent).accepted
    except InputError:
        return True
