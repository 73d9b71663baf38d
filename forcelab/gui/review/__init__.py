"""The Review workspace: timeline pairs, and what leads from them to every mistake."""
