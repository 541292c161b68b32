"""Policies as plain data, in files; some travel with the package, each with a model card."""

from drone_rl.policies.zoo.description import PolicyDescription, parse
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
from drone_rl.policies.zoo.migration import describe
from drone_rl.policies.zoo.onnx_model import make_onnx, open_onnx
from drone_rl.policies.zoo.registry import register_network, register_transform

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
    "register_network",
    "register_transform",
    "shifts_path",
]
