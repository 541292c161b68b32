import pytest
import torch

from drone_rl.evaluation import Episodes, summarise
from drone_rl.explain.verdict import Kind, judge_policy


def summary(left, right, ahead=0.9, episodes=300):
    """Episodes of one cube each, a third on each side, of which such shares are collected."""
    each = episodes // 3
    side = torch.arange(3).repeat_interleave(each)[:, None]  # Side: left, ahead, right
    collected = torch.cat(
        [torch.arange(each) < round(share * each) for share in (left, ahead, right)]
    )[:, None]
    return summarise(
        Episodes(
            collected=collected,
            side=side,
            end_reason=torch.ones(episodes, dtype=torch.int64),
            length=torch.ones(episodes, dtype=torch.int64),
        )
    )


@pytest.mark.parametrize(
    ("left", "right", "ahead", "kind"),
    [
        (0.99, 0.99, 0.99, Kind.GOOD),
        (0.0, 0.95, 0.95, Kind.ONE_SIDED_RIGHT),
        (0.95, 0.0, 0.95, Kind.ONE_SIDED_LEFT),
        (0.2, 0.2, 0.4, Kind.POOR),
        (0.0, 0.0, 1.0, Kind.POOR),
        (0.6, 0.9, 0.9, Kind.NONE),
    ],
)
def test_kinds(left, right, ahead, kind):
    verdict = judge_policy(summary(left, right, ahead), num_cubes=1)
    assert verdict.kind is kind
    assert verdict.certain


def test_a_small_sample_is_not_certain():
    assert not judge_policy(summary(0.99, 0.99, 0.99, episodes=15), num_cubes=1).certain
    assert not judge_policy(summary(0.28, 0.75), num_cubes=1).certain


def test_exit_codes_and_words():
    verdicts = {k: judge_policy(summary(*k, ahead=0.95), 1) for k in ((0.0, 0.95), (0.99, 0.99))}
    one_sided = verdicts[0.0, 0.95].as_dict()
    assert one_sided["exit_code"] == 11
    assert "left" in one_sided["sentence"] and "0% of those on its left" in one_sided["sentence"]
    assert [kind.exit_code for kind in Kind] == [0, 10, 11, 11, 12]
