import pytest
import torch
from torch import nn

from drone_rl.utils.checkpoint import check_weights
from drone_rl.utils.errors import InputError

EXPECTED = nn.Linear(4, 2, device="meta").state_dict()


def weights(**changes):
    found = {**nn.Linear(4, 2).state_dict(), **changes}
    return {key: value for key, value in found.items() if value is not None}


def test_those_of_the_network_are_taken():
    found = weights()
    assert check_weights(found, EXPECTED) == found


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"weight": torch.zeros(3, 4)}, r"weight' is \(3, 4\) in the file and \(2, 4\) by"),
        ({"bias": None}, "bias' is absent in the file"),
        ({"more": torch.zeros(1)}, r"more' is \(1,\) in the file and absent"),
        ({"weight": torch.zeros(2, 4, dtype=torch.float64)}, r"\(2, 4\) of float64 in"),
        ({"weight": torch.zeros(2, 4, dtype=torch.int64)}, "of int64"),
        ({"bias": torch.tensor([0.0, float("nan")])}, "bias hold NaN"),
        ({"bias": torch.tensor([0.0, -float("inf")])}, "bias hold NaN or infinity"),
        ({"bias": [0.0, 0.0]}, r"no tensor \(list\)"),
        ({3: torch.zeros(2)}, "mapping"),
    ],
)
def test_the_first_difference_is_named(changes, message):
    found = {**weights(), **changes}
    with pytest.raises(InputError, match=message):
        check_weights({k: v for k, v in found.items() if v is not None}, EXPECTED)
