"""Returns of the steps of an episode: pure functions of rewards.

Every function takes `reward` and `done` of shape (*batch, T, 1), time in dimension -2, of complete
episodes: no return crosses a `done`, and the last step of every row must be one. A flat batch
(T, 1) of episodes one after the other and a batch (N, T, 1) are equivalent.

The original study has five variants, `advantage_type` 0 to 4: `standardized`, `linear_ramp`,
`reward_to_go`, `success_scaled` and `time_baseline`. They are implemented as they were meant: an
episode of constant return standardizes to zero instead of dividing by zero, and the baselines of
`time_baseline` and `leave_one_out` never contain the episode that they are subtracted from.

Unbiased means: with the loss summed over steps and divided by the number of episodes, the expected
gradient is that of the expected reward (undiscounted), or that of Eq. 15 (discounted). Biases are
measured by enumerating all outcomes of small batches on the process of Fig. 3
(`drone_rl.envs.three_state`), two steps long, both actions equally likely, gamma 0.95; angles are
those between the expected update and the exact gradient. Discounting alone turns it by 1.4 degrees.
"""

import torch
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence

from drone_rl.utils.errors import InputError

ROUNDING = 1e-6
"""Deviation of returns, in rewards, up to which they differ by rounding errors alone."""


def episode_lengths(done: Tensor) -> list[int]:
    """Return the lengths of the episodes, row after row, from end flags (*batch, T, 1).

    Raises:
        InputError: A row does not end with its last episode.
    """
    if not bool(done[..., -1, :].all()):
        raise InputError(
            "a return needs complete episodes, but a row's last step is not done; "
            "collect with EpisodeCollector, or cut the unfinished tail"
        )
    ends = done.flatten().nonzero()[:, 0]
    return torch.diff(ends, prepend=ends.new_tensor([-1])).tolist()


def total_reward(reward: Tensor, done: Tensor) -> Tensor:
    """Return the whole episode's reward at every step, r(tau) of Eq. 12; unbiased."""
    padded, lengths = _pad(reward, done)
    return _unpad(padded.sum(0).expand_as(padded), lengths, reward)


def reward_to_go(reward: Tensor, done: Tensor, gamma: float) -> Tensor:
    """Discounted return, Eq. 14: g_t = r_{t+1} + gamma g_{t+1}; unbiased. Shape: (*batch, T, 1)."""
    padded, lengths = _pad(reward, done)
    return _unpad(_discount(padded, gamma), lengths, reward)


def standardized(reward: Tensor, done: Tensor, gamma: float) -> Tensor:
    """Discounted return, (g - mean) / std over each episode (Algorithm 4, line 2; footnote 5).

    The deviation is the population's; an episode of constant return gets zeros. Mean and deviation
    are the episode's own, so this is biased in batches of any size: an episode of one step teaches
    nothing, nor does, undiscounted, one that is rewarded at its end alone. With odds of 9 to 1 at
    the first step and 1 to 9 at the second, the angle is 38.7 degrees.
    """
    padded, lengths = _pad(reward, done)
    returns = _discount(padded, gamma)
    alive = _alive(lengths, returns)
    centred = returns - _mean(returns, alive)
    deviation = _mean(centred.square(), alive).sqrt()
    return _unpad(torch.where(deviation > ROUNDING, centred / deviation, 0.0), lengths, reward)


def linear_ramp(reward: Tensor, done: Tensor) -> Tensor:
    """The episode's reward times a ramp from 1/T at its first step to 1 at its last.

    The ramp depends on how long the episode is yet to become, so this is biased in batches of any
    size: by 11.3 degrees.
    """
    padded, lengths = _pad(reward, done)
    step = torch.arange(1, padded.shape[0] + 1, device=padded.device)[:, None]
    ramp = step / torch.tensor(lengths, device=padded.device)
    return _unpad(padded.sum(0) * ramp, lengths, reward)


def success_scaled(reward: Tensor, done: Tensor, gamma: float, max_reward: float) -> Tensor:
    """Discounted return times exp(r(tau) - max_reward): episodes count by their success.

    Where an episode has one reward of 1 or none, that is a constant factor. Otherwise it is biased
    towards what succeeds wholly, if seldom: an even chance of 2 is preferred to 1.1 for sure.
    """
    scale = (total_reward(reward, done) - max_reward).exp()
    return reward_to_go(reward, done, gamma) * scale


def time_baseline(reward: Tensor, done: Tensor, gamma: float, baseline: Tensor) -> Tensor:
    """Return the discounted return minus a baseline for each time step of an episode; unbiased.

    The baseline (steps,) is from earlier episodes; times beyond its end have baseline 0.
    """
    padded, lengths = _pad(reward, done)
    steps = min(len(baseline), len(padded))
    returns = _discount(padded, gamma)
    returns[:steps] -= baseline[:steps, None]
    return _unpad(returns, lengths, reward)


def leave_one_out(reward: Tensor, done: Tensor, gamma: float) -> Tensor:
    """Discounted return minus the mean, at the same time step, of the other episodes still going.

    The baseline does not depend on the episode's own actions, so this is unbiased, as long as it is
    neither scaled (`scale_to_unit`) nor averaged over steps (`ReinforceLoss`); an episode that goes
    on alone has baseline 0.
    """
    padded, lengths = _pad(reward, done)
    returns = _discount(padded, gamma)
    others = _alive(lengths, returns).sum(1, keepdim=True) - 1
    baseline = (returns.sum(1, keepdim=True) - returns) / others.clamp(min=1)
    return _unpad(returns - baseline, lengths, reward)


def batch_normalized(reward: Tensor, done: Tensor, gamma: float) -> Tensor:
    """Discounted return, (g - mean) / std over the whole batch; zeros if it is constant.

    Mean and deviation contain the episode itself, so this is biased, less the larger the batch: by
    10.9 degrees with 2 episodes, 1.9 with 8; with a single one it is `standardized`.
    """
    returns = reward_to_go(reward, done, gamma)
    centred = returns - returns.mean()
    deviation = centred.square().mean().sqrt()
    return centred / deviation if deviation > ROUNDING else torch.zeros_like(centred)


def scale_to_unit(returns: Tensor) -> Tensor:
    """Divide by the root mean square of the batch, which keeps zero where it is.

    The batch's own returns are in the divisor, so what was unbiased becomes biased, though less the
    larger the batch. `leave_one_out`: by 8.7 degrees with 3 episodes, 2.6 with 8, 0.1 with 64.
    Returns that differ from 0 by rounding errors alone become 0 and are not scaled up.
    """
    rms = returns.square().mean().sqrt()
    return returns / rms if rms > ROUNDING else torch.zeros_like(returns)


def mean_by_time(returns: Tensor, done: Tensor) -> tuple[Tensor, Tensor]:
    """Return mean and number of the episodes still going at each time step, (longest,)."""
    padded, lengths = _pad(returns, done)
    count = _alive(lengths, padded).sum(1)
    return padded.sum(1) / count, count


def _pad(values: Tensor, done: Tensor) -> tuple[Tensor, list[int]]:
    """Episodes side by side, zeros after their ends. Shape: (longest, episodes)."""
    if values.shape != done.shape or values.shape[-1] != 1:
        raise ValueError(
            f"values {tuple(values.shape)} and done {tuple(done.shape)} must both be (*batch, T, 1)"
        )
    lengths = episode_lengths(done)
    return pad_sequence(list(values.flatten().float().split(lengths))), lengths


def _unpad(padded: Tensor, lengths: list[int], like: Tensor) -> Tensor:
    episodes = zip(padded.T, lengths, strict=True)
    return torch.cat([episode[:length] for episode, length in episodes]).reshape(like.shape)


def _discount(padded: Tensor, gamma: float) -> Tensor:
    returns = padded.cpu().numpy().copy()  # numpy: ten times faster than torch for short rows
    for t in range(len(returns) - 2, -1, -1):
        returns[t] += gamma * returns[t + 1]
    return torch.from_numpy(returns).to(padded.device)


def _alive(lengths: list[int], padded: Tensor) -> Tensor:
    step = torch.arange(len(padded), device=padded.device)[:, None]
    return step < torch.tensor(lengths, device=padded.device)


def _mean(padded: Tensor, alive: Tensor) -> Tensor:
    return (padded * alive).sum(0) / alive.sum(0)
