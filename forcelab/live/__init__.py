"""What is computed of a stream while it is captured: labels with their certainty, and wavelets."""
