"""Probabilities of actions over time, under the name by which the review knows them."""

from forcelab.recognition.certainty import RATE, Certainty

__all__ = ["RATE", "Certainty"]
