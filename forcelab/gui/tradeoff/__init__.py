"""The Trade-off workspace: how well settings recognise, against what they cost."""
