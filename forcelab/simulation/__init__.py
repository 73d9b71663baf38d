"""The simulated tongs: contact mechanics, choreographies, sensors, coders and video."""
