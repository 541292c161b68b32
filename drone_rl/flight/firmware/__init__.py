"""Flight controllers that aren't ours: software (Betaflight) and hardware (MAVLink) in the loop."""
