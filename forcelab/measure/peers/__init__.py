"""Ways of others to recognise time series, measured beside ours where they are installed."""
