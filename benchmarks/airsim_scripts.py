"""Run the programs of `airsim_programs` through AirSim's own clients, each against a new server."""

import json
import os
import re
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.airsim_programs import PROGRAMS
from benchmarks.airsim_programs.program import VERSIONS, mistakes
from drone_rl.flight.airsim.serving import serve
from drone_rl.flight.airsim.settings_file import parse_settings
from drone_rl.utils.errors import InputError
from tools.airsim_clients import CLIENTS, python_of

ROOT = Path(__file__).resolve().parents[1]
_NAMES = ("airsim-1.1.7", "airsim-1.2.8", "airsim-1.8.1", "cosysairsim-3.5.0")
CLIENT_OF: dict[str, str] = dict(zip(VERSIONS, _NAMES, strict=True))
"""Installed clients by version."""
PAIRS = [(name, version) for name, one in PROGRAMS.items() for version in one.clients]
"""Programs, and the versions that have their calls."""


def bench_scripts(folder: Path) -> dict[str, Any]:
    """Run all programs through all clients that have their calls.

    Returns:
        "airsim_scripts": kinds of programs; "airsim_scripts_right": those whose numbers are right
        through every client; "airsim_scripts_wrong": the others, with what is wrong, by client.

    Raises:
        InputError: A client is not installed.
    """
    wrong: dict[str, dict[str, list[str]]] = {}
    for name, version in PAIRS:
        if not python_of(CLIENT_OF[version]).exists():
            raise InputError(
                f"{CLIENT_OF[version]} is not installed; run python -m tools.airsim_clients"
            )
        found = run_script(name, version, folder / f"{name}-{version}")
        if found:
            wrong.setdefault(name, {})[version] = found
    return {
        "airsim_scripts": len(PROGRAMS),
        "airsim_scripts_right": len(PROGRAMS) - len(wrong),
        "airsim_scripts_wrong": wrong,
    }


def run_script(name: str, version: str, folder: Path) -> list[str]:
    """Run one program through one client; return what is wrong, each as a line."""
    one, folder = PROGRAMS[name], folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    settings = parse_settings(one.settings.replace("FOLDER", str(folder)))
    options: dict[str, Any] = {"scene": "empty", "clock": "lockstep"}
    options |= {"patience_s": 0.002, **one.options}  # programs join at once
    page = (ROOT / "docs" / "airsim.md").read_text()
    fixes = re.search(r'title="airsim_fixes.py"\n(.*?)```', page, re.DOTALL)
    assert fixes is not None
    if version in VERSIONS[2:]:  # those with the transport that the page recommends
        (folder / "airsim_fixes.py").write_text(fixes[1])
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    if version == "airsim-1.2":
        options = {"raw_channels": 4, **options}
    with serve(settings, port=0, **options) as server:
        client = CLIENT_OF[version]
        command = [
            *(str(python_of(client)), "-m", "benchmarks.airsim_programs"),
            *(CLIENTS[client].module, str(server.address[1]), name),
        ]
        done = subprocess.run(
            command,
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    if done.returncode:
        return [done.stderr.strip().splitlines()[-1]]
    measured: Mapping[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return mistakes(one, version, measured)
