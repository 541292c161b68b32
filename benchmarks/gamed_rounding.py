"""Policies whose actions depend on the order of summation, the batch, or earlier calls.

The files contain the shipped policy "good" with an additional hidden unit. In exact arithmetic its
activation is 1; in float32 it depends on which of 2^24, 1 and -2^24 are added first. This
activation decides whether the policy always moves left.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from drone_rl.policies.policy import load_policy
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.sim.actions import Move
from drone_rl.trust.judge import judge
from drone_rl.trust.shifts import shifts
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verification.prove import prove

BIG = 2.0**24
"""Float32 can't represent numbers between this one and 2^24 + 2."""
_STRONG = 1000.0
"""Exceeds every logit of "good"."""
_PLACES = 4 * 14
"""Outputs of each channel of the last convolution."""


def cases(folder: Path) -> dict[str, Callable[[], bool]]:
    """Write the policies; return for each whether the attacked analysis judges it good.

    Args:
        folder: Folder of the files; created if missing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    fused = _by_bias(folder, "fused", 0.0, _STRONG)
    batches = _by_inputs(folder, "batches", _STRONG)
    policies = {
        "good in the fused kernel only": fused,
        "good in PyTorch only": _by_bias(folder, "pytorch", _STRONG, -_STRONG),
        "good in large batches only": batches,
        "good one at a time only": _by_inputs(folder, "alone", -_STRONG, _STRONG),
        "subnormal weights": subnormal(folder),
        "non-finite logits": non_finite(folder),
        "bad one at a time": _bad_rows(lambda count: slice(count if count == 1 else 0)),
        "bad in batches of 7": _bad_rows(lambda count: slice(count if count == 7 else 0)),
        "bad in the first place of a small batch": _bad_rows(lambda count: slice(count < 4)),
        "bad beyond place 500": _bad_rows(lambda count: slice(500, None)),
    }
    return {
        **{name: partial(judged_good, policy) for name, policy in policies.items()},
        "proved for one cube by rounding": partial(proved, fused),
        "in an operating domain by rounding": partial(in_domain, batches),
    }


def judged_good(policy: Any) -> bool:
    """Return whether a policy is judged good and certain; refused policies are not."""
    try:
        return judge(policy, progress=silent).verdict.exit_code == 0
    except InputError:
        return False


def proved(path: Path) -> bool:
    """Return whether a policy is proved for one cube."""
    try:
        return prove(path, task={"num_cubes": 1}, progress=silent).is_proved
    except InputError:
        return False


def in_domain(path: Path) -> bool:
    """Return whether `shifts` finds a policy good without perturbation."""
    few: dict[str, Any] = {"axes": ["noise"], "strengths": [1], "modes": ["constant"]}
    result = shifts(path, episodes=1, domain_episodes=200, progress=silent, **few)
    return result.domain is not None and result.domain.plain.good


def widened() -> tuple[PolicyDescription, dict[str, Tensor]]:
    """Return description and weights of "good" with an additional channel and hidden unit.

    The channel of the last convolution is 1 everywhere. The unit, the last one of "fc1", has zero
    input and output weights.
    """
    good = load_policy("good")
    network: Any = good.description.network
    (first, channels), (hidden,) = network.channels, network.hidden
    weights = {name: value.clone() for name, value in good.state.weights.items()}
    weights = {name: _grown(name, value, channels, hidden) for name, value in weights.items()}
    bias = next(name for name in weights if "conv2.bias" in name)
    weights[bias][-1] = 1.0
    wider = network.replace(channels=(first, channels + 1), hidden=(hidden + 1,))
    return good.description.replace(network=wider), weights


def _grown(name: str, value: Tensor, channels: int, hidden: int) -> Tensor:
    """Return a parameter padded with zeros to the shape with the new channel and unit."""
    layer, kind = name.split(".")[-2:]
    shape = list(value.shape)
    if layer == "conv2":
        shape[0] += 1
    elif layer == "fc1":
        shape[0] = hidden + 1
        if kind == "weight":
            shape[1] = (channels + 1) * _PLACES
    elif layer == "logits" and kind == "weight":
        shape[1] += 1
    grown = torch.zeros(shape)
    grown[tuple(slice(n) for n in value.shape)] = value
    return grown


def write(
    folder: Path, name: str, described: PolicyDescription, weights: dict[str, Tensor]
) -> Path:
    """Write a policy file as `drone-rl export` does, with the metadata of "good"."""
    path = folder / f"{name}.safetensors"
    policy = load_policy("good").state.replace(description=described, weights=weights)
    path.write_bytes(policy.to_bytes())
    return path


def parameter(weights: dict[str, Tensor], layer: str) -> Tensor:
    """Return a parameter by layer and kind, such as "fc1.weight"."""
    return next(value for name, value in weights.items() if name.endswith(layer))


def _by_bias(folder: Path, name: str, plain: float, by_unit: float) -> Path:
    """The 1 is the bias: fused kernels add it first, libraries last."""
    described, weights = widened()
    unit = parameter(weights, "fc1.weight")[-1]
    unit[-_PLACES], unit[-_PLACES + 1] = BIG, -BIG
    parameter(weights, "fc1.bias")[-1] = 1.0
    parameter(weights, "logits.weight")[Move.LEFT, -1] = by_unit
    parameter(weights, "logits.bias")[Move.LEFT] += plain
    return write(folder, name, described, weights)


def _by_inputs(folder: Path, name: str, by_unit: float, plain: float = 0.0) -> Path:
    """Terms that sum to 1 lie between the large terms, so the blocking of the sum decides."""
    described, weights = widened()
    unit = parameter(weights, "fc1.weight")[-1]
    unit[-_PLACES:] = 1.0 / _PLACES
    unit[-_PLACES], unit[-1] = BIG, -BIG
    parameter(weights, "logits.weight")[Move.LEFT, -1] = by_unit
    parameter(weights, "logits.bias")[Move.LEFT] += plain
    return write(folder, name, described, weights)


def subnormal(folder: Path) -> Path:
    """The activation is a subnormal number, which some processor modes flush to 0."""
    described, weights = widened()
    parameter(weights, "fc1.bias")[-1] = 0.9 * 2.0**-126
    for name in ("logits.weight", "logits.bias"):
        parameter(weights, name).mul_(2.0**-8)
    parameter(weights, "logits.weight")[Move.LEFT, -1] = 1.9 * 2.0**127
    parameter(weights, "logits.bias")[Move.LEFT] -= 1.9 * 0.9 * 2.0
    return write(folder, "subnormal", described, weights)


def non_finite(folder: Path) -> Path:
    """Finite weights whose products overflow float32."""
    described, weights = widened()
    parameter(weights, "fc1.bias")[-1] = 1e30
    parameter(weights, "logits.weight")[Move.LEFT, -1] = -1e30
    return write(folder, "non_finite", described, weights)


def _bad_rows(rows: Callable[[int], slice]) -> Callable[[Tensor], Tensor]:
    """Return the shipped policy "good" as a callable that moves left in some rows of a batch."""
    network = load_policy("good").make_network()

    @torch.no_grad()
    def logits(pixels: Tensor) -> Tensor:
        changed = network(pixels).clone()
        changed[rows(len(pixels)), Move.LEFT] += _STRONG
        return changed

    return logits
