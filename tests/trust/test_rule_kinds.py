import subprocess
import sys

from drone_rl.trust.rule import KINDS, Kind


def test_exit_statuses():
    assert [kind.exit_code for kind in Kind] == [0, 18, 10, 11, 11, 12]


def test_families_and_mirror_images():
    assert {kind.family for kind in Kind} == set(KINDS)
    assert Kind.ONE_SIDED_LEFT.family == Kind.ONE_SIDED_RIGHT.family == "one-sided"
    assert Kind.ONE_SIDED_LEFT.mirrored is Kind.ONE_SIDED_RIGHT
    assert all(kind.mirrored.mirrored is kind for kind in Kind)
    assert Kind.GOOD.mirrored is Kind.GOOD
    assert Kind.TRIVIAL.family == "good, but trivial"


def test_kinds_need_no_torch():
    code = "import sys, drone_rl.trust.rule; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
