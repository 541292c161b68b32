import subprocess
import sys

from drone_rl.trust.rule import KINDS, VerdictKind


def test_exit_statuses():
    assert [kind.exit_code for kind in VerdictKind] == [0, 18, 10, 11, 11, 12]


def test_families_and_mirror_images():
    assert {kind.family for kind in VerdictKind} == set(KINDS)
    assert VerdictKind.ONE_SIDED_LEFT.family == VerdictKind.ONE_SIDED_RIGHT.family == "one-sided"
    assert VerdictKind.ONE_SIDED_LEFT.mirrored is VerdictKind.ONE_SIDED_RIGHT
    assert all(kind.mirrored.mirrored is kind for kind in VerdictKind)
    assert VerdictKind.GOOD.mirrored is VerdictKind.GOOD
    assert VerdictKind.TRIVIAL.family == "good, but trivial"


def test_kinds_need_no_torch():
    code = "import sys, drone_rl.trust.rule; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
