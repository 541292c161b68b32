"""How good a policy is, measured and filmed."""
