from drone_rl.explanations.sections import find_sections
from drone_rl.explanations.threads import aside, is_aside


def test_a_section_is_aside_if_it_says_so():
    @aside
    def section():
        return 3

    assert is_aside(section) and section() == 3
    assert not is_aside(len)


def test_those_aside_are_those_that_ask_neither_worlds_nor_hooks():
    assert [n for n, s in find_sections().items() if is_aside(s)] == ["class_models", "embedding"]
