"""Tasks of terms: objects, and named functions of a step for rewards, ends and success."""
