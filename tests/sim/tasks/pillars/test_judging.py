from drone_rl.sim.tasks import Pillars
from drone_rl.sim.tasks.pillars.rules import EndReason


def test_what_verdicts_know_of_it():
    task = Pillars()
    assert (task.name, task.terms.goal, task.terms.target) == ("pillars", "row", "pillar")
    assert task.success_end == EndReason.FINISH_LINE
    assert task.expected_end == EndReason.PILLAR_TOUCHED
    assert task.strata == ("left", "ahead", "right")
    assert task.oracle.reads == ("drone", "rows", "next_row")
    assert set(task.luck) - {"random"} == set(task.make_dynamics().actions.names)
    assert set(task.scored) <= set(task.entries)
