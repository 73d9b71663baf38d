"""Settings with which an evaluation of a small project takes a tenth of a second."""

FAST = ["--classifier", "naive-bayes", "--max-scale", "64", "--jobs", "1"]
