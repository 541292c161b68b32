import dataclasses

import pytest

from benchmarks.gamed_case import GamedCase


def test_the_analysis_runs_only_when_it_is_called():
    calls = []
    case = GamedCase("memory", lambda: calls.append(1) or True)
    assert (case.name, calls) == ("memory", [])
    assert case.is_judged_good() is True and calls == [1]
    with pytest.raises(dataclasses.FrozenInstanceError):
        case.name = "other"
