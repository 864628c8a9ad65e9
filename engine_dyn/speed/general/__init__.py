"""The solver that takes any design, one design at a time.

front, driver        what Python calls, and the kernel that loops over designs
reduction            from the inputs of a design to the few numbers of its equation
periodic             which method finds the periodic solution, and whether there is one
segments, newton, stiff    iteration of the load term, Newton's method, strong loads
second_driver, stable_cycle, radau    cycles followed in time, for designs that the others leave
cycles, euler, picard      the two methods that repeat cycles from a start
speeds, storage      extremes and means of a solution; results
scratch              working memory

Kernels have more parameters than other functions: they take plain numbers and arrays, because
a record of them would be copied at each call, and the bounds between compiled functions decide the
last bits.
"""
