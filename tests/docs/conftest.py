"""The site, made as `make docs` makes it, where no network is."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.composing import composing_fast

ROOT = Path(__file__).parents[2]
OFFLINE = """
import socket, sys
def refuse(*args, **kwargs):
    raise OSError(f"asked for the network: {args}")
socket.socket.connect = socket.create_connection = socket.getaddrinfo = refuse
from mkdocs.__main__ import cli
cli(sys.argv[1:])
"""


@pytest.fixture(scope="session", autouse=True)
def _composing_fast():
    with composing_fast():
        yield


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """Its folder."""
    pytest.importorskip("material", reason="the extra docs isn't installed")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-c", OFFLINE, "build", "--strict", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder
