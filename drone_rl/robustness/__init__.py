"""Under which conditions a policy is good: what is different, flights there, how far it goes."""
