"""`python -m tools.cards`: write the model cards of the shipped policies from their files."""

import hashlib
from pathlib import Path

import drone_rl
from drone_rl.trust.export import Card

ZOO = Path(drone_rl.__file__).parent / "policies" / "zoo"


def card_of(path: Path) -> str:
    """Return the card of a policy file, with sentences as they are worded today.

    The figures are those of the file's metadata.
    """
    state = drone_rl.load_policy(path).state
    verdict = {"seed": state["seed"], "seed_is_fixed": True, **state["verdict"]}
    described = state["description"]
    origin = {name: described.get(name) for name in ("task", "appearance", "dynamics")}
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    about = {**state, **origin, "verdict": verdict, "name": path.stem, "digest": digest}
    return Card.read(about, path.stem).text()


if __name__ == "__main__":
    for file in sorted(ZOO.glob("*.safetensors")):
        file.with_suffix(".md").write_text(card_of(file), encoding="utf-8")
