"""The wavelet engine: transforms to a tolerance, each scale by the cheapest way that holds it."""
