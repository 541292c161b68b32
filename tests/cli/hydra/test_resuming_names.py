from drone_rl.cli.hydra.resuming import translate_former
from drone_rl.cli.settings import PolicyCommandSettings


def test_a_trained_policy_was_once_called_checkpoint():
    policies = PolicyCommandSettings.prepare
    assert policies(["checkpoint=good", "seed=1"]) == ["policy=good", "seed=1"]
    assert policies(["policy=good", "hydra.checkpoint=x"]) == ["policy=good", "hydra.checkpoint=x"]


def test_a_network_was_once_called_policy():
    told = ["policy=mlp", "policy.hidden=[64]", "+policy.x=1", "++policy.y=2", "~policy.z"]
    assert translate_former(told) == [
        *("network=mlp", "network.hidden=[64]", "+network.x=1", "++network.y=2", "~network.z"),
    ]
    assert translate_former(["network=mlp", "a.policy=1", "policymaker=1"]) == [
        *("network=mlp", "a.policy=1", "policymaker=1"),
    ]
