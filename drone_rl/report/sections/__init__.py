"""The parts of a report, one a file: see `report/part.py`."""
