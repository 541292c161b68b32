"""Many trainings as one piece of work: started side by side, gone on with, reported."""
