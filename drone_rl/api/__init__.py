"""For programs and notebooks: make_env, train, load_policy, evaluate, judge, explain."""
