"""The RPC methods of AirSim's clients: versions 1.1, 1.2 to 1.8, and Cosys-AirSim 3.5.

A method is found by its name, and a client's version by the arguments: calls of version 1.1 name
no vehicle and request images by camera numbers; Cosys' image requests have an annotation name.
"""

from drone_rl.flight.airsim.methods import cameras as cameras
from drone_rl.flight.airsim.methods import control as control
from drone_rl.flight.airsim.methods import detections as detections
from drone_rl.flight.airsim.methods import images as images
from drone_rl.flight.airsim.methods import movements as movements
from drone_rl.flight.airsim.methods import scene as scene
from drone_rl.flight.airsim.methods import state as state
from drone_rl.flight.airsim.methods.registry import METHODS as METHODS
from drone_rl.flight.airsim.methods.registry import UnknownMethodError as UnknownMethodError
from drone_rl.flight.airsim.methods.registry import call as call
from drone_rl.flight.airsim.methods.registry import suggestion as suggestion
from drone_rl.flight.airsim.methods.support import PARTLY as PARTLY
from drone_rl.flight.airsim.methods.support import UNSUPPORTED as UNSUPPORTED
