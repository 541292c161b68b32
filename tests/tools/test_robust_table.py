"""The table of the ablation of randomized training."""

from benchmarks.robust import ARMS
from drone_rl.trust.axes import GROUPS
from tools.readme.robust import make_robust
from tools.readme.tables import UNKNOWN


def test_rows_are_groups_and_columns_are_arms():
    groups = {group: [0.8, 0.9] for group in GROUPS}
    arm = {"plain": [1.0, 0.99], "untouched": [0.5, 0.75], "all_kinds": [0.4, 0.6], **groups}
    table = make_robust({"robust_arms": {"all": arm}, "robust_untouched": ["dynamics"]})
    head, _, *lines = table.splitlines()
    assert head == "| success rate, % | " + " | ".join(ARMS) + " |"
    assert len(lines) == 1 + len(GROUPS) + 2
    assert lines[0].startswith("| training conditions |")
    assert lines[0].endswith(f"| {UNKNOWN} | 100 (99 to 100) |")
    assert lines[-3].startswith("| **dynamics** |") and lines[-3].endswith("| 85 (80 to 90) |")
    assert lines[-2].endswith("| 62 (50 to 75) |")
    assert lines[-1].startswith("| mean of all groups |") and lines[-1].endswith(
        "| 50 (40 to 60) |"
    )
    assert lines[1].startswith(f"| {GROUPS[0]} |")
