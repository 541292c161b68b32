"""`python -m tools.cards`: write the model cards of the shipped policies from their files."""

import hashlib
from pathlib import Path

import drone_rl
from drone_rl.trust.export import Card
from drone_rl.trust.results import Verdict

ZOO = Path(drone_rl.__file__).parent / "policies" / "zoo"


def card_of(path: Path) -> str:
    """Return the card of a policy file, with sentences as they are worded today.

    The figures are those of the file's metadata.
    """
    policy = drone_rl.load_policy(path).state
    verdict = {"seed": policy.seed, "seed_is_fixed": True, **(policy.verdict or {})}
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return Card(path.stem, digest, policy, Verdict.read(verdict)).text()


if __name__ == "__main__":
    for file in sorted(ZOO.glob("*.safetensors")):
        file.with_suffix(".md").write_text(card_of(file), encoding="utf-8")
