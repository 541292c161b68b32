"""Where an exported policy says that it comes from."""

import json

import pytest

import drone_rl
from drone_rl.config import DynamicsSettings
from drone_rl.config.commands import HeldOutSettings
from drone_rl.policies.zoo import TrainingProgress, certificate_path
from drone_rl.sweeps.manifest import Run, Sweep
from drone_rl.sweeps.rows import choice_in_sweep
from drone_rl.trust.coverage import find_domain
from drone_rl.trust.export import Card, export, recorded_command
from drone_rl.trust.results import Verdict
from drone_rl.trust.shifts_results import SavedShifts
from drone_rl.utils.errors import InputError
from drone_rl.verification.claim import find_claim
from tests.evidence import SAVED_SHIFTS, VERDICT, changed
from tests.sweeps.conftest import _verdict
from tests.trust.making import shifts_of

METRICS = "frames,seconds,train/running_reward\n100,1.0,1.5\n"
FIGURES = {"frames": 100, "episodes": 9, "seconds": 1.0, "running_reward": 1.5, "largest_reward": 3}


@pytest.fixture
def checkpoint(tmp_path):
    """The last checkpoint of the second of three runs of a sweep."""
    runs = [
        Run(i, (f"seed={i}", "sweep=seeds", "trial=4"), tmp_path / f"run_{i}") for i in range(3)
    ]
    sweep = Sweep(folder=tmp_path, command="drone-rl train sweep=seeds", settings={}, runs=runs)
    sweep.save()
    folder = runs[1].folder
    (folder / ".hydra").mkdir(parents=True)
    (folder / ".hydra" / "overrides.yaml").write_text("[seed=1]")
    (folder / "metrics.csv").write_text(METRICS)
    return folder / "checkpoints" / "last.pt"


def judged(checkpoint, **verdict):
    result = {"reason": "frames", **FIGURES, "verdict": {**_verdict("good"), **verdict}}
    (checkpoint.parents[1] / "result.json").write_text(json.dumps(result))


def test_origin_of_a_run_of_a_sweep(checkpoint):
    judged(checkpoint)
    command, chosen = choice_in_sweep(checkpoint)
    assert command == "drone-rl train seed=1 sweep=seeds hydra.mode=RUN"
    assert chosen == {"runs": 3, "episodes": 200}


def test_command_of_a_single_run(checkpoint):
    (checkpoint.parents[2] / "sweep.json").unlink()
    assert choice_in_sweep(checkpoint) is None
    policy = drone_rl.load_policy("good").state.replace(command="drone-rl train seed=9")
    assert recorded_command(checkpoint, policy) == "drone-rl train seed=1"
    exported = checkpoint.with_suffix(".safetensors")
    assert recorded_command(exported, policy) == "drone-rl train seed=9"


FEW = HeldOutSettings(episodes=4)
ONE = {"num_cubes": 1}
"""A task with short episodes."""


def test_card_quotes_and_copies_a_certificate(tmp_path):
    policy = drone_rl.load_policy("proved")
    made = certificate_path(policy.path)
    target = tmp_path / "mine.safetensors"
    export(policy, target, FEW, certificate=made, find_claim=find_claim)
    card = (tmp_path / "mine.md").read_text()
    assert "A certificate of success from every placement is" in card
    assert "not refuted by 3,000 episodes from fresh placements" in card
    assert "All figures except those of the certificate are from 4 episodes" in card
    beside = tmp_path / "mine.certificate.json"
    assert beside.read_bytes() == made.read_bytes()
    again = drone_rl.load_policy(target)
    assert find_claim(again, flights=20).checked == 20


@pytest.mark.parametrize(("name", "is_good"), [("good", True), ("right_and_forward", False)])
def test_card_quotes_and_copies_a_robustness_evaluation(tmp_path, name, is_good):
    """Those of one whom the card's verdict surely finds to be something else are not believed."""
    policy, made = drone_rl.load_policy(name).in_task(**ONE), tmp_path / "made.json"
    shifts_of(policy).write_json(made)
    settings = FEW.replace(episodes=4 if is_good else 300, num_envs=300)
    export(policy, tmp_path / "mine.safetensors", settings, shifts=made)
    card = (tmp_path / "mine.md").read_text()
    assert ("blur of up to 1 pixels" in card) == is_good
    assert "nothing is known of other colors, light or sizes" in card
    beside = tmp_path / "mine.shifts.json"
    assert beside.exists() == is_good
    if is_good:
        assert beside.read_bytes() == made.read_bytes()
        again = drone_rl.load_policy(tmp_path / "mine.safetensors")
        assert find_domain(again).path == str(beside)
        assert "see mine.shifts.json, dated" in card  # and no path of this machine


def test_command_of_a_resumed_run(checkpoint):
    (checkpoint.parents[2] / "sweep.json").unlink()
    noted = checkpoint.parents[1] / ".hydra" / "overrides.yaml"
    noted.write_text("[seed=1, resume=outputs/a, trainer.total_frames=9]")
    command = recorded_command(checkpoint, drone_rl.load_policy("good").state)
    assert command == "drone-rl train seed=1 trainer.total_frames=9"


def test_wrong_command_is_refused_before_any_episode(tmp_path, monkeypatch):
    monkeypatch.setattr("drone_rl.trust.export.judge_policy", lambda *_, **__: 1 / 0)
    settings = HeldOutSettings(episodes=2)
    with pytest.raises(InputError, match="command="):
        export(
            drone_rl.load_policy("good"), tmp_path / "a.safetensors", settings, command="rm -rf /"
        )


VERDICT_OF_CARD = changed(
    VERDICT,
    {"greedy.shares.left": {"mean": None, "lower95": 0.0, "upper95": 1.0, "count": 0}},
)


def lines(shifts=None, verdict=None, **changes):
    """Return a card, with changes of the policy file and of the verdict."""
    about = {
        "command": "drone-rl train seed=7",
        "progress": TrainingProgress(frames=12345),
        "provenance": {"versions": {"torch": "1", "torchrl": "2"}, "git_revision": "abc"},
        "seed": 5,
        "chosen": None,
    }
    policy = drone_rl.load_policy("good").state.replace(**{**about, **changes})
    judged = Verdict.read(changed(VERDICT_OF_CARD, verdict or {}))
    saved = None if shifts is None else SavedShifts.read(shifts)
    return Card("mine", "0123", policy, judged, saved).text().splitlines()


def described(**dynamics):
    settings = DynamicsSettings(mode="simple_flight", **dynamics)
    return drone_rl.load_policy("good").description.replace(dynamics=settings)


def test_card():
    found = lines()
    assert found[0] == "# mine"
    assert found[2].startswith(
        "**none of these** (certain: the procedure errs in at most 5% of cases)"
    )
    assert found[4].startswith("- It fails in 40.0% of episodes, most")
    assert found[5].startswith("- With sampled actions it collects every cube in 40.0%")
    baselines = "best random or constant actions (forward) | oracle |"
    table = found[found.index(f"| | most probable actions | sampled actions | {baselines}") :]
    assert "| cubes collected | 80.0% (78.0% to 82.0%) | 70.0% (" in table[3]
    assert table[4].startswith("| of those on its left | not offered | 40.0%")
    at = found.index("| fails first at | episodes | of | rate |")
    assert found[at + 2] == "| side: left | 150 | 300 | 50.0% (48.0% to 52.0%) |"
    assert found[at + 3].startswith("| end: step_limit | 40 | 400 |") and found[at + 4] == ""
    assert any("by `drone-rl train seed=7` for 12,345 frames" in line for line in found)
    assert "- SHA-256 of `mine.safetensors`: `0123`" in found
    assert "- revision abc; torch 1; torchrl 2; mujoco-warp unknown" in found


@pytest.mark.parametrize(
    ("part", "needed", "against"),
    [
        ("All figures are from 400 episodes", {}, {"worlds": "choice"}),
        ("how, is not recorded", {}, {"chosen": {"runs": 1, "episodes": None}}),
        ("one of the 7 runs of a sweep, which were compared by 20 episodes",
         {"chosen": {"runs": 7, "episodes": 20}}, {"chosen": {"runs": 7, "episodes": None}}),
        ("a quadrotor of 1 kg in still air",
         {"description": described()}, {"description": described(gusts=1.0)}),
        ("nothing is known of other colors, light or sizes", {},
         {"shifts": SAVED_SHIFTS, "verdict": {"certain": False}}),
        ("No episodes with sampled actions", {"verdict": {"sampled": None, "drawing": None}},
         {"verdict": {}}),
    ],
)  # fmt: skip
def test_a_contradicted_claim_of_a_card_is_not_made(part, needed, against):
    assert part in "\n".join(lines(**needed))
    assert part not in "\n".join(lines(**{**needed, **against}))
