import pytest
import torch

from drone_rl.envs.fault_models import dead_rows, late_frames, noise, out_of_focus
from drone_rl.trust.perturbations import FaultPipeline, frozen_frames


def picture(*values):
    """A picture of 4x3 pixels in each world, all of one value."""
    return torch.tensor(values)[:, None, None, None].expand(-1, 1, 4, 3).clone()


ALL = torch.arange(2)


def test_late_frames():
    spoil = FaultPipeline([late_frames(2)], 2, seed=0)
    seen = [spoil(picture(t / 10, t / 20), ALL)[:, 0, 0, 0].tolist() for t in range(4)]
    assert seen == [pytest.approx(v) for v in ([0, 0], [0, 0], [0, 0], [0.1, 0.05])]


def test_late_frames_of_the_active_environments():
    spoil = FaultPipeline([late_frames(1)], 2, seed=0)
    spoil(picture(0.1, 0.2), ALL)
    assert spoil(picture(0.4), torch.tensor([1]))[:, 0, 0, 0].tolist() == pytest.approx([0.2])


def test_dead_rows():
    few, more = (FaultPipeline([dead_rows(n)], 2, seed=3) for n in (1, 2))
    dead = [spoil(picture(1.0, 1.0), ALL)[:, 0, :, 0] == 0 for spoil in (few, more)]
    assert [d.sum(-1).tolist() for d in dead] == [[1, 1], [2, 2]]
    assert (dead[0] <= dead[1]).all()
    assert torch.equal(few(picture(0.5, 0.5), ALL)[:, 0, :, 0] == 0, dead[0])
    assert (more(picture(1.0, 1.0), ALL, -1.0).amin() == -1).all()


def test_frozen_frames():
    always = FaultPipeline([frozen_frames(1.0)], 2, seed=0)
    seen = [always(picture(t / 10, t / 10), ALL)[0, 0, 0, 0] for t in range(3)]
    assert seen == [0, 0, 0]
    never = FaultPipeline([frozen_frames(0.0)], 2, seed=0)
    assert [float(never(picture(t / 8, 0), ALL)[0, 0, 0, 0]) for t in range(3)] == [0, 0.125, 0.25]
    half = FaultPipeline([frozen_frames(0.5)], 500, seed=0)
    half(torch.zeros(500, 1, 4, 3), torch.arange(500))
    shown = half(torch.ones(500, 1, 4, 3), torch.arange(500))[:, 0, 0, 0]
    assert shown.mean() == pytest.approx(0.5, abs=0.08)


def test_noise_is_proportional_to_its_strength():
    gray = torch.full((2, 1, 4, 3), 0.5)
    one, two = (FaultPipeline([noise(s)], 2, seed=1)(gray, ALL) - 0.5 for s in (0.01, 0.02))
    torch.testing.assert_close(2 * one, two)
    assert one.abs().max() > 0


def test_correlation_of_noise():
    gray = torch.full((200, 1, 4, 3), 0.5)
    for fault, kept in ((noise(0.05, 19.5), 0.95), (noise(0.05), 0.0)):
        spoil = FaultPipeline([fault], 200, seed=1)
        one, two = (spoil(gray, torch.arange(200)).flatten() - 0.5 for _ in range(2))
        assert float(torch.corrcoef(torch.stack([one, two]))[0, 1]) == pytest.approx(kept, abs=0.05)


def test_faults_that_hide_objects():
    faults = [noise(0.5), dead_rows(2), out_of_focus(2.0)]
    sharp = picture(1.0, 1.0)
    seen = FaultPipeline(faults, 2, seed=5, hiding_only=True)(sharp, ALL)
    rows = FaultPipeline([noise(0.0), dead_rows(2)], 2, seed=5)(sharp, ALL)
    assert torch.equal(seen, rows)  # the same rows are dead as in what the policy sees
    assert set(seen.unique().tolist()) == {0.0, 1.0}
