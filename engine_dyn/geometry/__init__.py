"""Geometry and masses of the crank train: kinematics, cylinders and their arrangement."""
