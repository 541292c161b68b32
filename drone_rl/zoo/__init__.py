"""Trained policies that travel with the package: safetensors, each with a model card."""

from drone_rl.zoo.files import (
    card_path,
    export_policy,
    load_exported,
    policy_names,
    policy_path,
)

__all__ = ["card_path", "export_policy", "load_exported", "policy_names", "policy_path"]
