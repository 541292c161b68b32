"""Policies that deceive an analysis with a known seed, rounding or forged files do not succeed."""

import functools
import json

import pytest

import drone_rl
from benchmarks import adversaries, gamed_certificates, gamed_rounding
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import root_seed


def test_a_policy_that_depends_on_the_batch_is_not_good(tmp_path):
    assert not gamed_rounding.cases(tmp_path)["bad one at a time"]()


@pytest.mark.parametrize(
    "name", ["recurrent rounding", "blind sweep with memory", "blind sweep that counts calls"]
)
def test_adversaries_are_not_good(name, tmp_path, monkeypatch):
    monkeypatch.setattr(adversaries, "EPISODES", 150)
    assert not adversaries.cases(tmp_path)[name](root_seed(None))


@pytest.mark.parametrize(
    "name",
    [
        "a certificate of one box with plausible steps",
        "flying straight in a trivial task",
    ],
)
def test_forged_files_and_trivial_tasks_are_not_good(name, tmp_path, monkeypatch):
    few = functools.partial(drone_rl.judge, episodes=150, certificate_flights=400)
    monkeypatch.setattr(gamed_certificates, "judge", few)
    assert not gamed_certificates.cases(tmp_path)[name]()


def test_a_certificate_of_many_boxes_is_not_proved(monkeypatch, tmp_path):
    """In small: 4 boxes of one cube, no episodes that check it; the proof refutes it."""
    one_sided = drone_rl.load_policy("right_and_forward").in_task(num_cubes=1)
    stated = gamed_certificates.many_boxes(one_sided, count=4, episodes=50)
    boxes = stated["outcomes"][0]["boxes"]
    assert boxes == [[[-6.0, -3.0]], [[-3.0, 0.0]], [[0.0, 3.0]], [[3.0, 6.0]]]
    (tmp_path / "certificate.json").write_text(json.dumps(stated))
    how = {"certificate": tmp_path, "certificate_flights": 0, "episodes": 1, "progress": silent}
    assert drone_rl.judge(one_sided, seed=3, **how).status("proved") == 16
    with pytest.raises(InputError, match=r"a proof finds 63\.8% of them"):
        drone_rl.judge(one_sided, require="proved", **how)
