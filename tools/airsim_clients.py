"""Install the clients of AirSim in environments of their own, for tests: `.clients/NAME`.

They can't share an environment with this package: each brings a transport of the same name, and
airsim 1.8.1 needs numpy 1. Version 1.1.7 is a single file of AirSim's repository, not a package.
"""

import subprocess
import sys
import sysconfig
import urllib.request
import venv
from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).resolve().parents[1] / ".clients"


class ClientPackage(NamedTuple):
    """A client and the arguments of the pip calls that install it."""

    module: str
    installs: tuple[tuple[str, ...], ...]
    file: str = ""
    """Address of its single file, where it is not a package."""


_TORNADO = ("numpy", "msgpack-rpc-python", "setuptools<66")
CLIENTS = {
    "airsim-1.1.7": ClientPackage(
        "AirSimClient",
        (_TORNADO,),
        "https://raw.githubusercontent.com/microsoft/AirSim/v1.1.7/PythonClient/AirSimClient.py",
    ),
    "airsim-1.2.8": ClientPackage("airsim", (_TORNADO, ("--no-deps", "airsim==1.2.8"))),
    "airsim-1.8.1": ClientPackage(
        "airsim",
        (
            ("numpy<2", "rpc-msgpack", "setuptools<70", "wheel"),
            ("--no-build-isolation", "--no-deps", "airsim==1.8.1"),
        ),
    ),
    "airsim-1.8.1-tornado": ClientPackage(  # AirSim's own transport, for Python up to 3.11
        "airsim",
        (
            ("numpy", "setuptools<66", "wheel"),
            ("--no-build-isolation", "msgpack-rpc-python"),
            ("--no-build-isolation", "--no-deps", "airsim==1.8.1"),
        ),
    ),
    "cosysairsim-3.5.0": ClientPackage("cosysairsim", (("cosysairsim==3.5.0",),)),
}


def python_of(name: str) -> Path:
    """Return the interpreter of a client's environment, which may not exist yet."""
    return FOLDER / name / "bin" / "python"


def install(name: str) -> None:
    """Create the environment of a client, if it isn't there."""
    if python_of(name).exists():
        return
    client = CLIENTS[name]
    file = urllib.request.urlopen(client.file, timeout=60).read() if client.file else b""
    venv.create(FOLDER / name, with_pip=True)
    for arguments in client.installs:
        command = [str(python_of(name)), "-m", "pip", "install", "-q", *arguments]
        subprocess.run(command, check=True)
    if file:
        base = {"base": str(FOLDER / name), "platbase": str(FOLDER / name)}
        packages = Path(sysconfig.get_path("purelib", vars=base))
        (packages / f"{client.module}.py").write_bytes(file)


if __name__ == "__main__":
    for one in sys.argv[1:] or CLIENTS:
        try:
            install(one)
            print(f"{one}: {python_of(one)}")
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"{one} can't be installed: {error}", file=sys.stderr)
