"""Programs in the style of AirSim's, each with its numbers; they run in the clients' environments.

`python -m benchmarks.airsim_programs MODULE PORT PROGRAM` runs one against a server and prints the
numbers that it has measured, as JSON. Nothing here may import more than Python and numpy.
"""

from benchmarks.airsim_programs import flights as flights
from benchmarks.airsim_programs import loops as loops
from benchmarks.airsim_programs import scenes as scenes
from benchmarks.airsim_programs import sensors as sensors
from benchmarks.airsim_programs import views as views
from benchmarks.airsim_programs.program import PROGRAMS as PROGRAMS
from benchmarks.airsim_programs.program import Program as Program
