"""`drone-rl terms`."""


def test_terms_are_listed_with_their_numbers_also_those_of_a_plugin(in_process, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(
        "from drone_rl import Step, reward\n"
        "@reward('of_mine', weight=-0.25)\n"
        "def of_mine(step: Step, least: float = 3.0) -> float:\n"
        "    'Height below `least`.'\n"
        "    return least - step.position[2]\n"
    )
    lines = in_process("terms", f"plugins={path}").stdout.splitlines()
    (mine,) = (line.split() for line in lines if "of_mine" in line)
    assert mine == ["of_mine", "weight=-0.25,", "least=3", "Height", "below", "`least`."]
    assert any(line.split()[:2] == ["altitude", "weight=-0.01,"] for line in lines)
