from drone_rl.explanations.behavior import flaws_section


def test_pairs_are_of_the_frames_analysed_and_loops_of_whole_flights(context):
    numbers, arrays = flaws_section(context)
    assert arrays == {}
    pairs, loops = numbers["contradictions"], numbers["loops"]
    assert pairs["frames"] == len(context.dataset) == 40
    assert pairs["pairs"] == sum(pairs[k] for k in ("contradictions", "justified", "unknown"))
    assert len(pairs["list"]) == min(pairs["pairs"], 50)
    flown = len(set(context.flights.episode.tolist()))
    assert loops["episodes"]["trials"] == flown >= 30
    assert loops["loops"] == len(loops["list"])
