"""Estimators as TorchRL transforms: in collectors and replay buffers, not in environments."""

import pytest
import torch
from tensordict import TensorDict
from torchrl.collectors import Collector
from torchrl.data import LazyTensorStorage, ReplayBuffer
from torchrl.envs import Compose, Reward2GoTransform, TransformedEnv
from torchrl.modules import RandomPolicy

from drone_rl import objectives
from drone_rl.config.learning import Gae, Returns
from drone_rl.envs.three_state import ThreeStateEnv
from drone_rl.objectives import BatchNormalized, RewardToGo, TimeBaseline, TotalReward
from drone_rl.utils.errors import InputError

BUILT_IN = (v for v in Returns.registry.values() if v.__module__ == Returns.__module__)
NAMES = [variant.factory.__name__ for variant in BUILT_IN if variant is not Gae]


def rows(rewards, ends):
    """Return a batch of shape (N, T)."""
    reward = torch.tensor(rewards, dtype=torch.float32)[..., None]
    done = torch.tensor(ends, dtype=torch.bool)[..., None]
    return TensorDict({"next": {"reward": reward, "done": done}}, reward.shape[:-1])


WHOLE = ([[1.0, 1.0, 2.0], [0.0, 4.0, 1.0]], [[0, 1, 1], [0, 0, 1]])
CUT = ([[1.0, 1.0, 2.0], [0.0, 4.0, 1.0]], [[0, 1, 0], [0, 0, 1]])


def collector(postproc):
    env = ThreeStateEnv(4)
    return Collector(
        env,
        RandomPolicy(env.action_spec),
        frames_per_batch=20,
        total_frames=40,
        postproc=postproc,
    )


POSTPROC = {
    "itself": lambda estimator: estimator,
    "its inverse": lambda estimator: estimator.inv,
    "a chain's inverse": lambda estimator: Compose(estimator).inv,
}


@pytest.mark.parametrize("how", POSTPROC)
def test_postproc_equals_torchrls_transform(how):
    torch.manual_seed(1)
    theirs, cut = Reward2GoTransform(0.5, out_keys=["theirs"]), 0
    for batch in collector(POSTPROC[how](RewardToGo(0.5))):
        known = batch.get(("collector", "mask"), torch.ones(4, 5, dtype=torch.bool))
        expected = theirs.inv(batch)["theirs"]
        torch.testing.assert_close(batch["return_to_go"][known], expected[known])
        assert known[batch["next", "done"][..., 0]].all() and known.any()
        cut += int((~known).sum())
    assert cut > 0


@pytest.mark.parametrize("name", NAMES)
def test_every_estimator_works_as_postproc(name):
    for batch in collector(getattr(objectives, name)()):
        assert batch["return_to_go"].shape == (4, 5, 1)
        assert batch["return_to_go"].isfinite().all()


def test_rows_of_complete_episodes_match_hand_computed_returns():
    batch = RewardToGo(0.5)(rows(*WHOLE))
    assert batch["return_to_go"][..., 0].tolist() == [[1.5, 1.0, 2.0], [2.25, 4.5, 1.0]]
    assert ("collector", "mask") not in batch.keys(True)


def test_unfinished_tail_is_masked_and_ignored():
    batch = RewardToGo(0.5)(rows(*CUT))
    assert batch["return_to_go"][..., 0].tolist() == [[1.5, 1.0, 0.0], [2.25, 4.5, 1.0]]
    assert batch["collector", "mask"].tolist() == [[True, True, False], [True, True, True]]
    batch = TotalReward()(rows(*CUT))
    assert batch["return_to_go"][..., 0].tolist() == [[2.0, 2.0, 0.0], [5.0, 5.0, 5.0]]
    scaled = BatchNormalized(0.5)(rows(*CUT))["return_to_go"][..., 0]
    assert float(scaled[0, 2]) == 0.0
    assert float(scaled.sum()) == pytest.approx(0.0, abs=1e-6)
    assert float(scaled.square().sum()) == pytest.approx(5.0)  # five steps are valid


def test_batch_without_episode_end_raises():
    with pytest.raises(InputError, match=r"no episode ends in a batch of shape \(1, 2\)"):
        RewardToGo()(rows([[1.0, 1.0]], [[0, 0]]))


def test_replay_buffer_estimates_on_extend_only():
    buffer = ReplayBuffer(storage=LazyTensorStorage(20), transform=RewardToGo(0.5), batch_size=64)
    for batch in (WHOLE, CUT):
        buffer.extend(rows(*batch).flatten())
    wanted = {(1.0, 1.5), (1.0, 1.0), (2.0, 2.0), (0.0, 2.25), (4.0, 4.5)}
    stored = buffer[:6]
    columns = (stored["next", "reward"][:, 0], stored["return_to_go"][:, 0])
    assert set(zip(*(column.tolist() for column in columns), strict=True)) == wanted
    sample = buffer.sample()
    assert sample["return_to_go"].shape == (64, 1)
    assert buffer[:]["collector", "mask"].tolist() == [True] * 12


def test_running_mean_includes_a_batch_once():
    """Sampling again must not change the running mean."""
    estimator = TimeBaseline(0.5, decay=0.5, max_steps=2, scale=False)
    buffer = ReplayBuffer(storage=LazyTensorStorage(8), transform=estimator, batch_size=8)
    buffer.extend(rows([[1.0, 1.0]], [[0, 1]])[0])
    before = estimator.baseline.tolist()
    buffer.sample()
    assert estimator.baseline.tolist() == before == [1.5, 1.0]


@pytest.mark.parametrize("wrap", [lambda t: t, Compose, lambda t: Compose(Compose(t))])
def test_estimator_cannot_transform_an_environment(wrap):
    with pytest.raises(InputError, match=r"RewardToGo needs whole episodes.*postproc"):
        TransformedEnv(ThreeStateEnv(2), wrap(RewardToGo()))
