"""Forces and torques of the crank train, cylinder by cylinder and for the whole engine.

torque            torque of gas and masses over the crank angle
mechanism         forces on piston, wall, rod, crank pin and frame, loads at the crosshead
bearings          loads of pins and journals over the cycle
bearing_extremes  the largest and the mean of them, of many designs
harmonics         orders of the torque
cylinder_harmonics    those of one cylinder
superposition     sums of curves over the cylinders, and extremes between their samples
balance           shaking forces and moments, and what balances them
"""
