"""Policies whose actions depend on the order of summation, the batch, or earlier calls.

The files contain the shipped policy "good" with an additional hidden unit. In exact arithmetic its
activation is 1; in float32 it depends on which of 2^24, 1 and -2^24 are added first. This
activation decides whether the policy always moves left.
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
_ABOUT = ("progress", "provenance", "command", "verdict", "worlds", "seed", "chosen")


def cases(folder: Path) -> list[GamedCase]:
    """Write the policies and return their cases.

    Args:
        folder: Folder of the files; created if missing.
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


def borrows_proof(folder: Path) -> bool:
    """Return whether few episodes prove a policy whose decisions all depend on rounding.

    It is the shipped policy "proved" with an additional unit, and has that policy's certificate.
    """
    policy = load_policy(subnormal(folder, "proved"))
    shipped = certificate_path(load_policy("proved").path)
    own = {"policy": one_box(policy, {})["policy"]}
    path = folder / "borrowed.json"
    path.write_text(json.dumps({**json.loads(shipped.read_text()), **own}))
    done = judge(policy, certificate=path, episodes=20, sampled=False, progress=silent)
    return done.status("proved") == 0


def in_domain(path: Path) -> bool:
    """Return whether `shifts` finds a policy good without perturbation."""
    few: dict[str, Any] = {"axes": ["noise"], "strengths": [1], "modes": ["constant"]}
    done = shifts(path, episodes=1, domain_episodes=200, progress=silent, **few)
    return bool(done.numbers["domain"]["plain"]["good"])


def widened(name: str = "good") -> tuple[dict[str, Any], dict[str, Tensor]]:
    """Return a policy's description and weights with an additional channel and hidden unit.

    The channel of the last convolution is 1 everywhere. The unit, the last one of "fc1", has zero
    input and output weights.

    Args:
        name: A shipped policy with two convolutions and one hidden layer.
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


def write(folder: Path, name: str, described: dict[str, Any], weights: dict[str, Tensor]) -> Path:
    """Write a policy file as `drone-rl export` does, with the metadata of "good"."""
    state, path = load_policy("good").state, folder / f"{name}.safetensors"
    about = {key: state[key] for key in _ABOUT if key in state}
    path.write_bytes(exported_bytes(weights, described, about))
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


def _close(folder: Path) -> Path:
    """The unit decides only where the largest logits are close."""
    described, weights = widened()
    unit = parameter(weights, "fc1.weight")[-1]
    unit[-_PLACES], unit[-_PLACES + 1] = BIG, -BIG
    parameter(weights, "fc1.bias")[-1] = 1.0
    parameter(weights, "logits.weight")[Move.LEFT, -1] = 5.0
    return write(folder, "close", described, weights)


def subnormal(folder: Path, name: str = "good") -> Path:
    """The activation is a subnormal number, which some processor modes flush to 0."""
    described, weights = widened(name)
    parameter(weights, "fc1.bias")[-1] = 0.9 * 2.0**-126
    for name in ("logits.weight", "logits.bias"):
        parameter(weights, name).mul_(2.0**-8)
    parameter(weights, "logits.weight")[Move.LEFT, -1] = 1.9 * 2.0**127
    parameter(weights, "logits.bias")[Move.LEFT] -= 1.9 * 0.9 * 2.0
    return write(folder, f"subnormal_{name}", described, weights)


def non_finite(folder: Path) -> Path:
    """Finite weights whose products overflow float32."""
    described, weights = widened()
    parameter(weights, "fc1.bias")[-1] = 1e30
    parameter(weights, "logits.weight")[Move.LEFT, -1] = -1e30
    return write(folder, "non_finite", described, weights)


Logits = Callable[[Tensor], Tensor]


def _callable(bad_rows: Callable[[Tensor], Sequence[int] | slice]) -> Logits:
    """Return the shipped policy "good" as a callable that moves left in some rows of a batch."""
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
        is_repeated = last == len(pixels) == 1
        last = len(pixels)
        return slice(len(pixels) if is_repeated else 0)

    return rows
