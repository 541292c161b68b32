"""Loads examples, which are programs outside the package, from their files."""

import importlib.util
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def example(request):
    """The example that a test module has in `PATH`."""
    path: Path = request.module.PATH
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
