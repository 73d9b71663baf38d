"""What every plot of the window is built from, on pyqtgraph."""
