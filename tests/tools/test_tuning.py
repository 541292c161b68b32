"""All learners are tuned with equal effort, and the benchmark uses the tuned settings."""

from benchmarks.peers import settings as peers
from tools import tuning


def test_every_learner_has_six_distinct_settings():
    tried = [*tuning.OURS.values(), *tuning.THEIRS.values()]
    assert {len(settings) for settings in tried} == {6}
    assert all(len({str(one) for one in settings}) == 6 for settings in tried)
    assert [*tuning.OURS, *tuning.THEIRS] == [*peers.LABELS]


def test_the_measured_settings_are_among_those_tried():
    for name in ("a2c", "ppo"):
        assert " ".join(peers.OURS[name]) in tuning.OURS[name]
    for name, settings in peers.THEIRS.items():
        assert dict(settings) in tuning.THEIRS[name]


def test_main_prints_a_line_per_setting(monkeypatch, capsys):
    times = iter([10.0, 12.0, 20.0, 21.0])

    def trained(name, settings, *, seed, episodes, max_frames):
        assert (seed in tuning.SEEDS, episodes, name) == (True, 0, "torchrl")
        return {"seconds": next(times), "frames": 2000, "is_solved": settings["lr"] < 3e-3}

    monkeypatch.setattr(tuning, "train_theirs", trained)
    monkeypatch.setattr(tuning, "THEIRS", {"torchrl": [{"lr": 2e-3}, {"lr": 3e-3}]})
    tuning.main(["torchrl"])
    assert capsys.readouterr().out.splitlines() == [
        'torchrl {"lr": 0.002} 11.0 s: 10.0, 12.0 s; 2,000, 2,000 frames',
        'torchrl {"lr": 0.003} 20.5 s (not all solved): 20.0, 21.0 s; 2,000, 2,000 frames',
    ]
