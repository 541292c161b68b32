"""Folders that tests of several files use, made once in a run whatever worker needs them first."""

import os
import shutil

from filelock import FileLock


def shared_folder(factory, name, make):
    """Return a folder that `make(folder)` has filled, in this or another worker of the run.

    Args:
        factory: The fixture `tmp_path_factory`.
        name: Name of the folder, one for each content.
        make: Fills an empty folder; runs in the first worker that needs it, others wait.
    """
    base = factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, unfinished = base / name, base / f"{name}.unfinished"
    with FileLock(f"{folder}.lock"):
        if not folder.exists():
            shutil.rmtree(unfinished, ignore_errors=True)  # of a test that failed
            unfinished.mkdir()
            make(unfinished)
            unfinished.rename(folder)
    return folder
