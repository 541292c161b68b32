"""Commands in this process, and a training that has ended."""

import subprocess
import sys

import pytest

from drone_rl.cli.main import main
from tests.cli.running import TINY, drone_rl
from tests.composing import composing_fast


@pytest.fixture(scope="session", autouse=True)
def _composing_fast():
    with composing_fast():
        yield


@pytest.fixture
def in_process(monkeypatch, capsys, tmp_path):
    """Runs a command in this process, which saves the seconds that imports take."""
    # Hydra's logging set-up would close the streams that pytest captures
    monkeypatch.setattr("logging.config.DictConfigurator.configure", lambda self: None)

    def call(*args, cwd=tmp_path):
        monkeypatch.chdir(cwd)
        monkeypatch.setattr(sys, "argv", ["drone-rl", *map(str, args)])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        code = stop.value.code
        if isinstance(code, str):  # what Python prints for sys.exit("...")
            printed, code = printed._replace(err=printed.err + code), 1
        return subprocess.CompletedProcess(args, code, printed.out, printed.err)

    return call


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    """A finished training of a second; tests may add folders to it, but change no file."""
    folder = tmp_path_factory.mktemp("run")
    done = drone_rl("train", *TINY, "hydra.run.dir=run", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "run"
