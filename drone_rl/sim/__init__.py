"""The simulator: tasks, vehicle dynamics, rendering, sensors, and the dm_control task."""
