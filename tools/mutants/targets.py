"""Which modules are mutated, and the tests that must notice: those that mirror a module first."""

from pathlib import Path

TARGETS: dict[str, tuple[str, ...]] = {
    "sim/tasks/collect_cubes/rules": ("sim/tasks/collect_cubes/test_rules", "sim/test_worlds"),
    "sim/actions": ("sim/test_actions",),
    "sim/parts": ("sim/test_parts", "sim/test_actions"),
    "sim/continuous_actions": ("sim/test_continuous_actions",),
    "policies/squashed_normal": ("policies/test_squashed_normal",),
    "sim/tasks/collect_cubes/changes": (
        "sim/tasks/collect_cubes/test_changes",
        "explanations/test_outcomes",
    ),
    "sim/tasks/collect_cubes/goals": (
        "sim/tasks/collect_cubes/test_goals",
        "verdicts/test_failures",
    ),
    "objectives/returns": ("objectives/test_returns",),
    "objectives/return_estimator": ("objectives/test_return_estimator",),
    "objectives/estimators": ("objectives/test_estimators",),
    "objectives/reinforce": ("objectives/test_reinforce",),
    "collectors/episodes": ("collectors/test_episodes",),
    "utils/seeding": ("utils/test_seeding",),
    "utils/intervals": ("utils/test_intervals",),
    "evaluation/*": ("evaluation/test_{name}",),
    "verdicts/*": ("verdicts/test_{name}", "verdicts"),
    "sweeps/statistics": ("sweeps/test_statistics",),
    **{
        f"explanations/{name}": (f"explanations/test_{name}",)
        for name in (
            "truth",
            "causal",
            "trust",
            "curves",
            "outcomes",
            "placebos",
            "patches",
            "alternatives",
            "randomised",
            "interventions",
            "response",
            "asymmetry",
            "contradictions",
            "loops",
        )
    },
}
"""Names below drone_rl and below tests, without suffix; * is any name, {name} the module's."""

NOT_MUTATED = ("evaluation/oracle", "evaluation/video")
"""Neighbours of a pattern that quote no figure: the flown baseline and the film."""


def find_targets(root: Path) -> dict[str, list[str]]:
    """Modules of a tree and their tests, both as paths below it.

    Raises:
        ValueError: A pattern finds no module, or a module none of its tests.
    """
    found = {}
    for pattern, tests in TARGETS.items():
        paths = sorted((root / "drone_rl").glob(f"{pattern}.py"))
        if not paths:
            raise ValueError(f"no module is called {pattern}; mend tools/mutants/targets.py")
        for path in paths:
            module = path.relative_to(root / "drone_rl").with_suffix("").as_posix()
            if path.stem == "__init__" or module in NOT_MUTATED:
                continue
            named = [f"tests/{test.format(name=path.stem)}" for test in tests]
            exist = [
                name for test in named for name in (test, f"{test}.py") if (root / name).exists()
            ]
            if not exist:
                raise ValueError(f"{module} has none of its tests: {', '.join(named)}")
            found[path.relative_to(root).as_posix()] = exist
    return found
