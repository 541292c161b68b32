from drone_rl.explanations.sections.evaluation import section


def test_the_verdict_rests_on_the_first_episodes_whoever_flew_before(context):
    numbers, arrays = section(context)
    again, _ = section(context)
    verdict = numbers["verdict"]
    assert arrays == {}
    assert verdict["greedy"]["episodes"] == 6
    assert verdict["good_share"] == 0.7
    assert numbers == again
