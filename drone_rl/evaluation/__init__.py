"""How good a policy is, measured and filmed."""

from drone_rl.evaluation.agreement import Agreement, agreement
from drone_rl.evaluation.evaluator import StepLog, run_episodes
from drone_rl.evaluation.metrics import Episodes, summarise
from drone_rl.evaluation.oracle import ConstantPolicy, Oracle, RandomPolicy

__all__ = [
    "Agreement",
    "ConstantPolicy",
    "Episodes",
    "Oracle",
    "RandomPolicy",
    "StepLog",
    "agreement",
    "run_episodes",
    "summarise",
]
