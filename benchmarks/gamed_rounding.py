"""Policies whose actions depend on the order of sums, on the batch, or on calls before.

Files are those of the shipped policy "good" with one more hidden unit. In exact arithmetic this
unit is 1; in float32 it depends on which of 2^24, 1 and -2^24 are added first. By it the policy
turns left for ever.
"""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from benchmarks.gamed_case import GamedCase
from benchmarks.gamed_certificates import one_box
from drone_rl.policies.policy import load_policy
from drone_rl.policies.zoo import certificate_path
from drone_rl.policies.zoo.files import exported_bytes
from drone_rl.robustness.shifts import shifts
from drone_rl.sim.actions import Move
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verdicts.judge import judge
from drone_rl.verification.prove import prove

BIG = 2.0**24
"""Float32 has no number between it and 2^24 + 2."""
_STRONG = 1000.0
"""Beats every logit of "good"."""
_PLACES = 4 * 14
"""Outputs of each channel of the last convolution."""
_ABOUT = ("progress", "provenance", "command", "verdict", "worlds", "seed", "chosen")


def cases(folder: Path) -> list[GamedCase]:
    """Make the policies.

    Args:
        folder: For their files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = {
        "good in the fused kernel only": _by_bias(folder, "fused", 0.0, _STRONG),
        "good in PyTorch only": _by_bias(folder, "pytorch", _STRONG, -_STRONG),
        "good in large batches only": _by_inputs(folder, "batches", _STRONG),
        "good one at a time only": _by_inputs(folder, "alone", -_STRONG, _STRONG),
        "fragile where logits are close": _close(folder),
        "subnormal weights": subnormal(folder),
        "non-finite logits": non_finite(folder),
    }
    found = [GamedCase(name, lambda path=path: judged_good(path)) for name, path in files.items()]
    fused = files["good in the fused kernel only"]
    found.append(GamedCase("proved for one cube by rounding", lambda: proved(fused)))
    batches = files["good in large batches only"]
    found.append(GamedCase("in an operating domain by rounding", lambda: in_domain(batches)))
    found.append(GamedCase("proved by a borrowed certificate", lambda: borrows_proof(folder)))
    made = {
        "bad one at a time": lambda: _if_alone,
        "bad in batches of 7": lambda: _if_seven,
        "bad in the first place of a small batch": lambda: _if_first,
        "bad beyond place 500": lambda: _if_far,
        "bad after 300 calls": _after_calls,
        "bad when called with single frames in turn": _after_single,
    }
    return found + [
        GamedCase(name, lambda make=make: judged_good(_callable(make())))
        for name, make in made.items()
    ]


def judged_good(policy: Any) -> bool:
    """Whether a policy is called good and certain; refused policies are not."""
    try:
        return judge(policy, progress=silent).verdict.exit_code == 0
    except InputError:
        return False


def proved(path: Path) -> bool:
    """Whether a policy is proved for one cube."""
    try:
        return prove(path, task={"num_cubes": 1}, progress=silent).is_proved
    except InputError:
        return False


def borrows_proof(folder: Path) -> bool:
    """Whether few episodes prove a policy whose decisions all depend on rounding.

    It is the shipped policy "proved" with one more unit, and comes with that policy's certificate.
    """
    policy = load_policy(subnormal(folder, "proved"))
    shipped = certificate_path(load_policy("proved").path)
    own = {"policy": one_box(policy, {})["policy"]}
    path = folder / "borrowed.json"
    path.write_text(json.dumps({**json.loads(shipped.read_text()), **own}))
    done = judge(policy, certificate=path, episodes=20, sampled=False, progress=silent)
    return done.status("proved") == 0


def in_domain(path: Path) -> bool:
    """Whether a policy is surely good where nothing is different."""
    few: dict[str, Any] = {"axes": ["noise"], "strengths": [1], "modes": ["constant"]}
    done = shifts(path, episodes=1, domain_episodes=200, progress=silent, **few)
    return bool(done.numbers["domain"]["plain"]["good"])


def widened(name: str = "good") -> tuple[dict[str, Any], dict[str, Tensor]]:
    """Return a policy's description and weights with a constant channel and a hidden unit more.

    The channel is 1 everywhere; the unit, the last one of "fc1", has no inputs and no outputs yet.

    Args:
        name: Of a shipped policy with two convolutions and one hidden layer.
    """
    good = load_policy(name)
    described = good.description.as_dict()
    channels, (hidden,) = described["network"]["channels"], described["network"]["hidden"]
    network = {**described["network"], "channels": [channels[0], channels[1] + 1]}
    weights = {name: value.clone() for name, value in good.state["policy"].items()}
    weights = {name: _grown(name, value, channels[1], hidden) for name, value in weights.items()}
    bias = next(name for name in weights if "conv2.bias" in name)
    weights[bias][-1] = 1.0
    return {**described, "network": {**network, "hidden": [hidden + 1]}}, weights


def _grown(name: str, value: Tensor, channels: int, hidden: int) -> Tensor:
    """One parameter with room for what is more, filled with zeros."""
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


def write(folder: Path, name: str, described: dict[str, Any], weights: dict[str, Tensor]) -> Path:
    """Write a policy as `drone-rl export` does, with the other data of "good"."""
    state, path = load_policy("good").state, folder / f"{name}.safetensors"
    about = {key: state[key] for key in _ABOUT if key in state}
    path.write_bytes(exported_bytes(weights, described, about))
    return path


def part(weights: dict[str, Tensor], layer: str) -> Tensor:
    """A parameter by its layer and kind, such as "fc1.weight"."""
    return next(value for name, value in weights.items() if name.endswith(layer))


def _by_bias(folder: Path, name: str, plain: float, by_unit: float) -> Path:
    """The 1 is the bias: kernels begin with it, libraries end with it."""
    described, weights = widened()
    unit = part(weights, "fc1.weight")[-1]
    unit[-_PLACES], unit[-_PLACES + 1] = BIG, -BIG
    part(weights, "fc1.bias")[-1] = 1.0
    part(weights, "logits.weight")[Move.LEFT, -1] = by_unit
    part(weights, "logits.bias")[Move.LEFT] += plain
    return write(folder, name, described, weights)


def _by_inputs(folder: Path, name: str, by_unit: float, plain: float = 0.0) -> Path:
    """Ones stand between the large terms, so that blocks of a sum decide."""
    described, weights = widened()
    unit = part(weights, "fc1.weight")[-1]
    unit[-_PLACES:] = 1.0 / _PLACES
    unit[-_PLACES], unit[-1] = BIG, -BIG
    part(weights, "logits.weight")[Move.LEFT, -1] = by_unit
    part(weights, "logits.bias")[Move.LEFT] += plain
    return write(folder, name, described, weights)


def _close(folder: Path) -> Path:
    """The unit is too weak to decide but where the best logits are close."""
    described, weights = widened()
    unit = part(weights, "fc1.weight")[-1]
    unit[-_PLACES], unit[-_PLACES + 1] = BIG, -BIG
    part(weights, "fc1.bias")[-1] = 1.0
    part(weights, "logits.weight")[Move.LEFT, -1] = 5.0
    return write(folder, "close", described, weights)


def subnormal(folder: Path, name: str = "good") -> Path:
    """The unit is a subnormal number, which some processors settings replace by 0."""
    described, weights = widened(name)
    part(weights, "fc1.bias")[-1] = 0.9 * 2.0**-126
    for name in ("logits.weight", "logits.bias"):
        part(weights, name).mul_(2.0**-8)
    part(weights, "logits.weight")[Move.LEFT, -1] = 1.9 * 2.0**127
    part(weights, "logits.bias")[Move.LEFT] -= 1.9 * 0.9 * 2.0
    return write(folder, f"subnormal_{name}", described, weights)


def non_finite(folder: Path) -> Path:
    """Finite weights whose products are too large for float32."""
    described, weights = widened()
    part(weights, "fc1.bias")[-1] = 1e30
    part(weights, "logits.weight")[Move.LEFT, -1] = -1e30
    return write(folder, "non_finite", described, weights)


Logits = Callable[[Tensor], Tensor]


def _callable(bad_rows: Callable[[Tensor], Sequence[int] | slice]) -> Logits:
    """The shipped policy "good", but for rows in which it turns left."""
    network = load_policy("good").make_network()

    @torch.no_grad()
    def logits(pixels: Tensor) -> Tensor:
        found = network(pixels).clone()
        found[bad_rows(pixels), Move.LEFT] += _STRONG
        return found

    return logits


def _if_alone(pixels: Tensor) -> slice:
    return slice(len(pixels) if len(pixels) == 1 else 0)


def _if_seven(pixels: Tensor) -> slice:
    return slice(len(pixels) if len(pixels) == 7 else 0)


def _if_first(pixels: Tensor) -> slice:
    return slice(1 if len(pixels) < 4 else 0)


def _if_far(pixels: Tensor) -> slice:
    del pixels
    return slice(500, None)


def _after_calls() -> Callable[[Tensor], slice]:
    calls = 0

    def rows(pixels: Tensor) -> slice:
        nonlocal calls
        calls += 1
        return slice(len(pixels) if calls > 300 else 0)

    return rows


def _after_single() -> Callable[[Tensor], slice]:
    last = 0

    def rows(pixels: Tensor) -> slice:
        nonlocal last
        is_in_turn = last == len(pixels) == 1
        last = len(pixels)
        return slice(len(pixels) if is_in_turn else 0)

    return rows
