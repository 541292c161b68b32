import torch

from drone_rl.verification.chances import _row


def test_no_chance_is_shown_in_scientific_notation():
    shares = torch.tensor([5.696e-12, 0.25, 1.0], dtype=torch.float64)
    assert _row("all cubes", shares) == ["all cubes", "41.67%", "less than 0.01%", "100%"]
