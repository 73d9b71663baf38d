"""The label workspace: panels on one time axis, and the ways to paint."""
