from pathlib import Path

import pytest

from drone_rl.explanations.behavior import evaluation_section
from drone_rl.verification.claim import Claim


def test_the_verdict_rests_on_the_first_episodes_whoever_flew_before(context):
    numbers, arrays = evaluation_section(context)
    again, _ = evaluation_section(context)
    verdict = numbers["verdict"]
    assert arrays == {}
    assert verdict["greedy"]["episodes"] == 6
    assert verdict["good_share"] == 0.7
    assert numbers == again


def test_a_certificate_is_held_against_the_flights(context, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(context, "claim", Claim(Path("c.json"), None, "it is damaged"))
    verdict = evaluation_section(context)[0]["verdict"]
    assert verdict["proof"] == {"refused": "it is damaged"}
    assert "A certificate is not quoted: it is damaged." in verdict["sentence"]
