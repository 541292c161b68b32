import pytest

from drone_rl.cli.bench import BenchCommand


@pytest.mark.parametrize(
    ("words", "overrides"),
    [
        ([], []),
        (["render", "seeds=[1]"], ["seeds=[1]", "only=[render]"]),
        (["render", "--quick"], ["only=[render]", "quick=true"]),
        (["only=[ray]", "--quick"], ["only=[ray]", "quick=true"]),
        (["--help"], ["--help"]),
        (
            ["--quick"],
            [
                "only=[render,collector,dm_control,scaling,memory,solve,seeds,large]",
                "quick=true",
            ],
        ),
        (["parallel"], ["only=[sweeps,kills]"]),
    ],
)
def test_names_and_quick_stand_for_settings(words, overrides):
    assert BenchCommand.prepare(words) == overrides
