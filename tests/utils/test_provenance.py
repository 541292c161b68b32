import torch

from drone_rl.utils.provenance import machine, num_cores, provenance, versions


def test_versions_are_those_that_run():
    assert versions()["torch"] == torch.__version__


def test_machine_and_provenance_are_plain_values():
    assert machine()["cores"] == num_cores() >= 1
    assert set(provenance()) == {"versions", "git_revision", "machine"}
