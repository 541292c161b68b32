"""Descriptions and files of policies; the package contains some, each with a model card."""

from drone_rl.policies.zoo.description import PolicyDescription, describe, parse
from drone_rl.policies.zoo.files import (
    card_path,
    certificate_path,
    load_exported,
    policy_names,
    policy_path,
    read_checkpoint,
    read_policy,
    shifts_path,
)
from drone_rl.policies.zoo.onnx_model import make_onnx, open_onnx

__all__ = [
    "PolicyDescription",
    "card_path",
    "certificate_path",
    "describe",
    "load_exported",
    "make_onnx",
    "open_onnx",
    "parse",
    "policy_names",
    "policy_path",
    "read_checkpoint",
    "read_policy",
    "shifts_path",
]
