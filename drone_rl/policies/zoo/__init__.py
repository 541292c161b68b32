"""Policy descriptions, policy files, and the shipped policies with their model cards."""

from drone_rl.policies.zoo.description import PolicyDescription as PolicyDescription
from drone_rl.policies.zoo.description import describe as describe
from drone_rl.policies.zoo.files import Checkpoint as Checkpoint
from drone_rl.policies.zoo.files import SavedPolicy as SavedPolicy
from drone_rl.policies.zoo.files import TrainingProgress as TrainingProgress
from drone_rl.policies.zoo.files import certificate_path as certificate_path
from drone_rl.policies.zoo.files import find_policy as find_policy
from drone_rl.policies.zoo.files import fingerprint as fingerprint
from drone_rl.policies.zoo.files import policy_names as policy_names
from drone_rl.policies.zoo.files import policy_path as policy_path
from drone_rl.policies.zoo.files import read_checkpoint as read_checkpoint
from drone_rl.policies.zoo.files import read_policy as read_policy
from drone_rl.policies.zoo.files import shifts_path as shifts_path
from drone_rl.policies.zoo.onnx_model import make_onnx as make_onnx
from drone_rl.policies.zoo.onnx_model import open_onnx as open_onnx
