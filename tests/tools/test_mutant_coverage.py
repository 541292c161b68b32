"""Choice of the tests for a mutant, from hand-made records."""

import types

import pytest

pytest.importorskip("cosmic_ray", reason="pip install -e '.[mutants]'")

from tools.mutants import coverage

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
OTHER_MODULE = "from drone_rl.sim.small import low\n\n\ndef both(x):\n    return low(x)\n"


@pytest.fixture
def root(tmp_path):
    for path, text in {"sim/small.py": MODULE, "envs/other.py": OTHER_MODULE}.items():
        (tmp_path / "drone_rl" / path).parent.mkdir(parents=True)
        (tmp_path / "drone_rl" / path).write_text(text)
    return tmp_path


def record(*tests, failed=()):
    blocks = sorted({block for _, _, hits in tests for block in hits})
    rows = [[test, seconds, [blocks.index(b) for b in hits]] for test, seconds, hits in tests]
    return {"failed": list(failed), "blocks": blocks, "tests": rows}


LOW, BRANCH, HIGH = (f"drone_rl.sim.small:{name}" for name in ("low#0", "low#1", "high#0"))
OWN, OTHER, NEAR, FAR = (
    f"tests/{name}.py"
    for name in ("sim/test_small", "envs/test_other", "sim/test_a", "envs/test_b")
)
RECORDS = {
    OWN: record((f"{OWN}::low", 0.5, [LOW]), (f"{OWN}::high", 1.0, [HIGH])),
    NEAR: record((f"{NEAR}::quick", 2.0, [LOW]), (f"{NEAR}::none", 50.0, [])),
    OTHER: record((f"{OTHER}::low", 0.25, [LOW, BRANCH]), failed=[f"{OTHER}::wrong"]),
    FAR: record((f"{FAR}::long", 19.0, [LOW]), (f"{FAR}::longer", 40.0, [LOW])),
}


def mutant(line, column=4, module="drone_rl/sim/small.py"):
    return types.SimpleNamespace(
        module=module, spec=types.SimpleNamespace(start_pos=(line, column))
    )


def test_tests_of_the_module_precede_others_that_run_the_block(root):
    covered = coverage.Coverage(root, RECORDS)
    chosen = covered.tests_for(mutant(5))
    assert chosen.own == (OWN,)  # the whole file, although only one of its tests runs the block
    # same package first; of a slow file only tests that run the block; within the budget
    assert chosen.others == (f"{NEAR}::quick", OTHER)
    assert chosen.limit_s == coverage.START_S + coverage.TIME_FACTOR * (1.5 + 2.0 + 0.25)
    assert covered.failed == [f"{OTHER}::wrong"]


def test_a_branch_is_covered_by_tests_that_take_it(root):
    chosen = coverage.Coverage(root, RECORDS).tests_for(mutant(6, 8))
    assert chosen.own == () and chosen.others == (OTHER,)


def test_an_uncovered_block_has_no_tests(root):
    chosen = coverage.Coverage(root, RECORDS).tests_for(mutant(15))
    assert chosen.own == chosen.others == ()


def test_code_run_at_import_is_covered_by_tests_of_module_and_importers(root):
    records = {OWN: RECORDS[OWN], OTHER: record((f"{OTHER}::both", 1.0, []))}
    chosen = coverage.Coverage(root, records).tests_for(mutant(1, 8))
    assert chosen.own == (OWN,) and chosen.others == (OTHER,)


def test_a_warp_module_gets_more_time(root):
    kernel = "import warp as wp\n\n\n@wp.func\ndef twice(x: float):\n    return 2.0 * x\n"
    (root / "drone_rl" / "sim" / "kernel.py").write_text(kernel)
    own = "tests/sim/test_kernel.py"
    records = {own: record((f"{own}::twice", 1.0, ["drone_rl.sim.kernel:twice#0"]))}
    chosen = coverage.Coverage(root, records).tests_for(mutant(6, 11, "drone_rl/sim/kernel.py"))
    assert chosen.own == (own,)
    assert chosen.limit_s == coverage.START_S + coverage.TIME_FACTOR + coverage.COMPILING_S


def test_importers_through_a_package_count(root):
    (root / "drone_rl" / "sim" / "__init__.py").write_text("from drone_rl.sim.small import LIMIT\n")
    (root / "drone_rl" / "envs" / "far.py").write_text("from drone_rl.sim import LIMIT\n")
    far = "tests/envs/test_far.py"
    records = {far: record((f"{far}::far", 1.0, []))}
    chosen = coverage.Coverage(root, records).tests_for(mutant(1, 8))
    assert chosen.own == () and chosen.others == (far,)


@pytest.mark.parametrize(
    ("test", "first"),
    [
        (f"{OWN}::low", (OWN,)),  # a fast file
        (f"{FAR}::long", (f"{FAR}::long",)),
        (f"{FAR}::removed", ()),
        (f"{OTHER}::wrong", ()),  # fails without a mutation
        (None, ()),
    ],
)
def test_the_test_that_killed_a_mutant_before_comes_first(root, test, first):
    assert coverage.Coverage(root, RECORDS).again(test) == first
