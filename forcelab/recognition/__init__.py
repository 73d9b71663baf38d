"""Recognition: features, classifiers, filters, training and evaluation."""
