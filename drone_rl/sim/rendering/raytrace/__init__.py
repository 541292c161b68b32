"""The ray tracer: kernels, shared structures and the renderer that launches them."""
