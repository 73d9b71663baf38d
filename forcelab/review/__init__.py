"""Review of a trained run beside the labels: differences, verdicts, agreement, explanations."""
