"""What a model card is made of, by hand."""

SHARE = {"mean": 0.9, "lower95": 0.8, "upper95": 1.0}
NOT_OFFERED = {"mean": None, "lower95": 0.0, "upper95": 1.0}
SUCCESS = {"share": 0.75, "lower95": 0.7, "upper95": 0.8, "trials": 400}


def flights(share=0.9):
    sides = {"all": {**SHARE, "mean": share}, "left": NOT_OFFERED, "ahead": SHARE, "right": SHARE}
    return {"episodes": 400, "success": SUCCESS, "shares": sides}


LARGEST = {"by": "cube", "value": "first", "episodes": 400, "failed": 31, **SUCCESS}
OTHER = {**LARGEST, "by": "end", "value": "step_limit", "failed": 4}
VERDICT = {
    "kind": "poor",
    "certain": True,
    "sentence": "This policy does not do its task.",
    "error_rate": 0.05,
    "greedy": flights(),
    "sampled": flights(0.6),
    "baselines": {
        "random": flights(0.1),
        "forward": flights(0.3),
        "left": flights(0.0),
        "right": flights(0.0),
        "oracle": flights(1.0),
    },
    "failures": {
        "rows": [{**LARGEST, "value": "second", "failed": 0}, OTHER, LARGEST],
        "largest": LARGEST,
        "bound": {"share": 0.25, "lower95": 0.2, "upper95": 0.3, "trials": 400},
    },
}
TASK = {"num_cubes": 3, "cube_size": 2.5, "lateral_bound": 6.0, "vertical_bound": 0.0}
CARD = {
    "command": "drone-rl train seed=7",
    "progress": {"frames": 12345},
    "provenance": {
        "versions": {"torch": "1", "torchrl": "2", "mujoco-warp": "3"},
        "git_revision": "abc",
    },
    "verdict": VERDICT,
    "worlds": "report",
    "seed": 5,
    "chosen": None,
    "task": TASK,
}
