"""A process that joins a Ray cluster keeps its signals, and mistakes are one line."""

import signal
import sys
import types

import pytest

from drone_rl.utils.errors import InputError
from drone_rl.utils.ray_cluster import connect


def join(monkeypatch, init, *, before=False, address=None):
    fake = types.SimpleNamespace(is_initialized=lambda: before, init=init)
    monkeypatch.setitem(sys.modules, "ray", fake)
    return connect(address, "hydra/launcher=ray")[1]


def test_it_does_not_take_over_sigterm(monkeypatch):
    before = signal.getsignal(signal.SIGTERM)
    try:
        assert join(monkeypatch, lambda **_: signal.signal(signal.SIGTERM, lambda *_: None))
        assert signal.getsignal(signal.SIGTERM) is before
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_cluster_out_of_reach_is_told_in_one_line(monkeypatch):
    def fail(**options):
        raise ConnectionError(options["address"])

    message = r"^hydra\.launcher\.address=host:1 can't be reached; start .*set it to local"
    with pytest.raises(InputError, match=message):
        join(monkeypatch, fail, address="host:1")
