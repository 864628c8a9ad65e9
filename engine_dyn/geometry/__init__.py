"""Geometry and masses of the crank train: kinematics, cylinders and their arrangement.

slider_crank, kinematic_series    the piston's motion, exact, and as a series of orders
velocity_harmonics, velocity_waves    its velocity as sines for batches, and as waves with an offset
masses                            rod and throw as two masses; inertia of the running gear
arrangement, layouts, firing_orders    throws, banks and cylinders; those with a customary name
cylinders, cylinder_means         what tells cylinders apart and what repeats; means over them
"""
