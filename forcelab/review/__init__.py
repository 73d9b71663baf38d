"""What a coder reviews: outcomes of training, and every place where human and model differ."""
