"""Commands in this process, and a training that has ended."""

import subprocess

import pytest

from tests.cli.running import TINY, run_main
from tests.composing import composing_fast


@pytest.fixture(scope="session", autouse=True)
def _composing_fast():
    with composing_fast():
        yield


@pytest.fixture(scope="session", autouse=True)
def _streams_stay():
    """Hydra's logging set-up would close the streams that pytest captures."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("logging.config.DictConfigurator.configure", lambda self: None)
        yield


@pytest.fixture
def in_process(capsys, tmp_path):
    """Runs a command in this process, which saves the seconds that imports take."""

    def call(*args, cwd=tmp_path):
        code = run_main(cwd, *args)
        printed = capsys.readouterr()
        if isinstance(code, str):  # what Python prints for sys.exit("...")
            printed, code = printed._replace(err=printed.err + code), 1
        return subprocess.CompletedProcess(args, code, printed.out, printed.err)

    return call


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    """A finished training of a second; tests may add folders to it, but change no file."""
    folder = tmp_path_factory.mktemp("run")
    assert run_main(folder, "train", *TINY, "hydra.run.dir=run") == 0
    return folder / "run"
