"""What can be chosen of a training: every setting once, with type, bounds, default and meaning.

Nothing here imports torch: a sweep composes and checks hundreds of settings before any run starts.
"""
