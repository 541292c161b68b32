"""Small tools that know nothing of simulators or learning, named by subject."""
