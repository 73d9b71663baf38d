"""The Capture workspace: sensors and cameras live, and recordings into the project."""
