from drone_rl.config import PillarsSettings
from drone_rl.sim.tasks.pillars.rules import EndReason, Side
from drone_rl.sim.tasks.pillars.terms import terms


def test_every_side_and_end_has_words():
    said = terms(PillarsSettings())
    assert set(said.sides) == set(said.places) == {side.name.lower() for side in Side}
    assert set(said.ends) == {end.name.lower() for end in EndReason if end}
    assert not said.follows and said.tested.startswith("4 rows of pillars 1 m wide, 0.25 for")
    assert said.reaches == "passes" and said.handles == "gets past the pillar"
    assert said.failing("row", "third") == "at the third row"
    assert said.failing("gap", "0.8 to 1.8 m") == "at gaps of 0.8 to 1.8 m"
