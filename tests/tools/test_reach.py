"""Which tests are chosen for a mutant, from records made by hand."""

import types

import pytest

from tools.mutants import reach

MODULE = """\
LIMIT = 3


def low(x):
    if x < LIMIT:
        return 1
    return 0


def high(x):
    return x > LIMIT


def unused(x):
    return x + 1
"""
OTHER = "from drone_rl.sim.small import low\n\n\ndef both(x):\n    return low(x)\n"


@pytest.fixture
def root(tmp_path):
    for path, text in {"sim/small.py": MODULE, "envs/other.py": OTHER}.items():
        (tmp_path / "drone_rl" / path).parent.mkdir(parents=True)
        (tmp_path / "drone_rl" / path).write_text(text)
    return tmp_path


def record(*tests, failed=()):
    blocks = sorted({block for _, _, hits in tests for block in hits})
    rows = [[test, seconds, [blocks.index(b) for b in hits]] for test, seconds, hits in tests]
    return {"failed": list(failed), "blocks": blocks, "tests": rows}


LOW, BRANCH, HIGH = (f"drone_rl.sim.small:{name}" for name in ("low#0", "low#1", "high#0"))
OWN, OTHERS, SLOW, WORLDS = (
    f"tests/{name}.py"
    for name in ("sim/test_small", "envs/test_other", "sim/test_a", "envs/test_b")
)
RECORDS = {
    OWN: record((f"{OWN}::low", 0.5, [LOW]), (f"{OWN}::high", 1.0, [HIGH])),
    SLOW: record((f"{SLOW}::quick", 2.0, [LOW]), (f"{SLOW}::none", 50.0, [])),
    OTHERS: record((f"{OTHERS}::low", 0.25, [LOW, BRANCH]), failed=[f"{OTHERS}::wrong"]),
    WORLDS: record((f"{WORLDS}::long", 19.0, [LOW]), (f"{WORLDS}::longer", 40.0, [LOW])),
}


def mutant(line, column=4, module="drone_rl/sim/small.py"):
    return types.SimpleNamespace(
        module=module, spec=types.SimpleNamespace(start_pos=(line, column))
    )


def test_own_tests_come_first_then_others_that_run_the_block(root):
    found = reach.Reach(root, RECORDS)
    chosen = found.tests_for(mutant(5))
    assert chosen.own == (OWN,)  # all of its tests, though one alone runs the block
    # of the same package first; of a long file what runs the block; within the budget
    assert chosen.others == (f"{SLOW}::quick", OTHERS)
    assert chosen.limit_s == reach.START_S + reach.PATIENCE * (1.5 + 2.0 + 0.25)
    assert found.failed == [f"{OTHERS}::wrong"]


def test_a_branch_is_run_by_those_that_take_it(root):
    chosen = reach.Reach(root, RECORDS).tests_for(mutant(6, 8))
    assert chosen.own == () and chosen.others == (OTHERS,)


def test_what_no_test_runs_has_none(root):
    chosen = reach.Reach(root, RECORDS).tests_for(mutant(15))
    assert chosen.own == chosen.others == ()


def test_what_runs_at_import_has_tests_of_the_module_and_of_its_importers(root):
    records = {OWN: RECORDS[OWN], OTHERS: record((f"{OTHERS}::both", 1.0, []))}
    chosen = reach.Reach(root, records).tests_for(mutant(1, 8))
    assert chosen.own == (OWN,) and chosen.others == (OTHERS,)


def test_a_module_that_warp_compiles_has_more_time(root):
    kernel = "import warp as wp\n\n\n@wp.func\ndef twice(x: float):\n    return 2.0 * x\n"
    (root / "drone_rl" / "sim" / "kernel.py").write_text(kernel)
    own = "tests/sim/test_kernel.py"
    records = {own: record((f"{own}::twice", 1.0, ["drone_rl.sim.kernel:twice#0"]))}
    chosen = reach.Reach(root, records).tests_for(mutant(6, 11, "drone_rl/sim/kernel.py"))
    assert chosen.own == (own,)
    assert chosen.limit_s == reach.START_S + reach.PATIENCE + reach.COMPILING_S


def test_importers_by_way_of_a_package_count_too(root):
    (root / "drone_rl" / "sim" / "__init__.py").write_text("from drone_rl.sim.small import LIMIT\n")
    (root / "drone_rl" / "envs" / "far.py").write_text("from drone_rl.sim import LIMIT\n")
    far = "tests/envs/test_far.py"
    records = {far: record((f"{far}::far", 1.0, []))}
    chosen = reach.Reach(root, records).tests_for(mutant(1, 8))
    assert chosen.own == () and chosen.others == (far,)
