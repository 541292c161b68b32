"""`python -m tools.cards`: write the model cards of the shipped policies from their files."""

import hashlib
import json
from pathlib import Path

import drone_rl
from drone_rl.trust.export import write_card
from drone_rl.trust.verdict_text import SENTENCES
from drone_rl.utils.text import say

ZOO = Path(drone_rl.__file__).parent / "policies" / "zoo"


def card_of(path: Path) -> str:
    """Return the card of a policy file, with sentences as they are worded today.

    The figures are those of the file's metadata. `NAME.shifts.json` next to it has the operating
    domain.
    """
    state = drone_rl.load_policy(path).state
    seed = {"seed": state["seed"], "seed_is_fixed": True}
    verdict = {**seed, **state["verdict"]}
    verdict["sentence"] = say(SENTENCES, verdict)
    shifts = path.with_suffix(".shifts.json")
    about = {
        **state,
        "verdict": verdict,
        "task": state["description"]["task"],
        "dynamics": state["description"].get("dynamics"),
        "shifts": json.loads(shifts.read_text()) if shifts.exists() else None,
    }
    return write_card(path.stem, hashlib.sha256(path.read_bytes()).hexdigest(), about)


if __name__ == "__main__":
    for file in sorted(ZOO.glob("*.safetensors")):
        file.with_suffix(".md").write_text(card_of(file), encoding="utf-8")
