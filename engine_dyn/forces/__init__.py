"""Forces and torques of the crank train, cylinder by cylinder and for the whole engine."""
